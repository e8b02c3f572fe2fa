// Quadrature encoders, every edge of both channels counted by interrupt.
#pragma once
#include <Arduino.h>

#include "wheels.h"

namespace encoders {

// A wheel as its interrupt leaves it: counts, and when the newest edge came (ticker::stamp).
struct Latch {
  int16_t count;
  uint8_t period;
  uint16_t halves;
};

void begin();

// Copy both wheels; interrupts must be off.
void latch(Latch *both);

// Whether a wheel has stepped both channels at once since the last call: an edge too fast to be seen, or noise.
bool impossible_step();

}  // namespace encoders
