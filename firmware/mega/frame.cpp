#include "frame.h"

#include <string.h>

namespace frame {
namespace {

const uint32_t NIBBLES[16] = {0x00000000, 0x1DB71064, 0x3B6E20C8, 0x26D930AC, 0x76DC4190, 0x6B6B51F4,
                              0x4DB26158, 0x5005713C, 0xEDB88320, 0xF00F9344, 0xD6D6A3E8, 0xCB61B38C,
                              0x9B64C2B0, 0x86D3D2D4, 0xA00AE278, 0xBDBDF21C};

uint32_t crc32(const uint8_t *data, uint8_t length) {
  uint32_t crc = 0xFFFFFFFF;
  while (length--) {
    crc ^= *data++;
    crc = NIBBLES[crc & 15] ^ (crc >> 4);
    crc = NIBBLES[crc & 15] ^ (crc >> 4);
  }
  return ~crc;
}

}  // namespace

uint8_t encode(uint8_t *body, uint8_t length, uint8_t *frame) {
  uint32_t crc = crc32(body, length - 4);
  memcpy(body + length - 4, &crc, 4);
  uint8_t count_at = 0, at = 1;
  for (uint8_t i = 0; i < length; i++) {
    if (body[i]) {
      frame[at++] = body[i];
    } else {
      frame[count_at] = at - count_at;
      count_at = at++;
    }
  }
  frame[count_at] = at - count_at;
  frame[at++] = 0;
  return at;
}

uint8_t decode(uint8_t *code, uint8_t length) {
  if (length < OVERHEAD + 1 || length > LONGEST + 1) return 0;
  uint8_t next = 0, to = 0;
  while (next < length) {
    uint8_t end = next + code[next];
    if (code[next] > length - next) return 0;
    for (uint8_t from = next + 1; from < end; from++) code[to++] = code[from];
    next = end;
    if (next < length) code[to++] = 0;
  }
  uint32_t sent, crc = crc32(code, to - 4);
  memcpy(&sent, code + to - 4, 4);
  return crc == sent ? to : 0;
}

}  // namespace frame
