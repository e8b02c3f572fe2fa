// The one clock: timer 3 counts half microseconds and ends a period of 5 ms 200 times a second.
#pragma once
#include <Arduino.h>

namespace ticker {

constexpr uint16_t PERIOD_US = 5000;
constexpr uint16_t HALVES = 2 * PERIOD_US;  // half microseconds in a period

// What the encoders had counted at the end of a period; taken in the interrupt, so a busy loop does not delay it.
struct Sample {
  uint32_t time_us;  // since the start, wraps
  int16_t count[2];  // wrap
  uint32_t edge[2];  // time of the newest edge, half microseconds since the start, wraps
  uint32_t now;      // time of this sample, likewise
};

void begin();

// Whether a period has ended since the last call. If several have, the newest is given.
bool take(Sample &sample);
bool waiting();

// Half microseconds since the start; wraps after 36 minutes.
uint32_t now();

// The period that is running, modulo 256, and the half microseconds of it; interrupts must be off.
inline __attribute__((always_inline)) void stamp(uint8_t &period, uint16_t &halves) {
  extern volatile uint8_t periods;
  uint16_t count = TCNT3;
  // A period that has just ended may still wait for its interrupt.
  uint8_t late = (TIFR3 & _BV(OCF3A)) && count < HALVES / 2;
  period = periods + late;
  halves = count;
}

}  // namespace ticker
