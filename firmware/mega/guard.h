// The chip's own watchdog: a loop that hangs has its motors off after 120 ms and is started anew.
#pragma once
#include <Arduino.h>

namespace guard {

void begin();
void alive();

// Bits: 1 power, 2 reset line, 4 brown-out, 8 this watchdog; 0 where the boot loader has cleared them.
uint8_t reset_cause();

}  // namespace guard
