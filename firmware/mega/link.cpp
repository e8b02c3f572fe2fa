#include "link.h"

#include <util/atomic.h>

#include "frame.h"

namespace link {
namespace {

// Rings of 256 bytes, so that their indices wrap by themselves: 22 ms of the line. Each index has one writer.
volatile uint8_t incoming[256], outgoing[256];
volatile uint8_t in_head, in_tail, out_head, out_tail;
volatile bool damaged;

uint8_t code[frame::ENCODED];
uint8_t length;
bool overlong;
uint8_t sequence;

}  // namespace

void begin() {
  UCSR0A = _BV(U2X0);
  UBRR0 = 16;  // 117647 baud, 2.1 % fast, which is what a Mega does for 115200
  UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);
  UCSR0B = _BV(RXEN0) | _BV(TXEN0) | _BV(RXCIE0);
}

bool waiting() { return in_head != in_tail; }

uint8_t receive(uint8_t *&body) {
  while (in_tail != in_head) {
    uint8_t byte = incoming[in_tail];
    in_tail = in_tail + 1;
    if (byte) {
      if (length < sizeof code) code[length++] = byte;
      else overlong = true;
      continue;
    }
    uint8_t got = overlong ? 0 : frame::decode(code, length);
    bool empty = length == 0;
    length = 0;
    overlong = false;
    if (got) {
      body = code;
      return got;
    }
    if (!empty) refuse();
  }
  return 0;
}

bool send(uint8_t *body, uint8_t size, bool may_be_left_out) {
  uint8_t free = out_tail - out_head - 1;
  if (free < (may_be_left_out ? 2 * frame::ENCODED : frame::ENCODED)) return false;
  body[1] = sequence++;
  uint8_t whole[frame::ENCODED];
  uint8_t count = frame::encode(body, size, whole);
  uint8_t head = out_head;
  for (uint8_t i = 0; i < count; i++) outgoing[head++] = whole[i];
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    out_head = head;
    UCSR0B |= _BV(UDRIE0);
  }
  return true;
}

void refuse() { damaged = true; }

bool refused() {
  bool was;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    was = damaged;
    damaged = false;
  }
  return was;
}

}  // namespace link

ISR(USART0_RX_vect) {
  using namespace link;
  uint8_t status = UCSR0A;  // before the byte, which takes it along
  uint8_t byte = UDR0;
  if (status & (_BV(FE0) | _BV(DOR0))) damaged = true;  // the CRC will find it out
  uint8_t next = in_head + 1;
  if (next == in_tail) {
    damaged = true;
    return;
  }
  incoming[in_head] = byte;
  in_head = next;
}

ISR(USART0_UDRE_vect) {
  using namespace link;
  UDR0 = outgoing[out_tail];
  out_tail = out_tail + 1;
  if (out_tail == out_head) UCSR0B &= ~_BV(UDRIE0);
}
