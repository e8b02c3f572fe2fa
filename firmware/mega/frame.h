// Frames of docs/base_protocol.md: COBS, length, CRC-32.
#pragma once
#include <stdint.h>

namespace frame {

constexpr uint8_t OVERHEAD = 6;   // type, sequence, CRC-32
constexpr uint8_t LONGEST = 64;   // body
constexpr uint8_t ENCODED = LONGEST + 2;

// Write a body of length bytes, whose last four are left for the CRC-32, as a frame; returns the frame's length.
uint8_t encode(uint8_t *body, uint8_t length, uint8_t *frame);

// Decode in place a frame without its last zero; returns the body's length, or 0 if any of it is wrong.
uint8_t decode(uint8_t *code, uint8_t length);

}  // namespace frame
