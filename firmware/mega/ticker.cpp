#include "ticker.h"

#include <util/atomic.h>

#include "encoders.h"

namespace ticker {

volatile uint8_t periods;

namespace {
volatile uint32_t time_us;
volatile bool fresh;
encoders::Latch latched[2];
uint8_t latched_period;
}  // namespace

void begin() {
  // What the Arduino core has started and nobody here uses, its clock (millis, delay) among it.
  TIMSK0 = 0;
  TCCR0B = TCCR1B = TCCR2B = 0;
  TCCR3A = 0;
  TCCR3B = 0;
  TCNT3 = 0;
  OCR3A = HALVES - 1;
  TCCR3B = _BV(WGM32) | _BV(CS31);  // clear on compare, 16 MHz / 8
  TIFR3 = _BV(OCF3A);
  TIMSK3 = _BV(OCIE3A);
}

bool waiting() { return fresh; }

bool take(Sample &sample) {
  encoders::Latch latch[2];
  uint8_t period;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    if (!fresh) return false;
    fresh = false;
    sample.time_us = time_us;
    latch[LEFT] = latched[LEFT];
    latch[RIGHT] = latched[RIGHT];
    period = latched_period;
  }
  sample.now = 2 * sample.time_us;
  for (uint8_t side = 0; side < 2; side++) {
    sample.count[side] = latch[side].count;
    uint8_t before = period - latch[side].period;
    sample.edge[side] = sample.now - before * (uint32_t)HALVES + latch[side].halves;
  }
  return true;
}

uint32_t now() {
  uint32_t start;
  uint8_t period, counted;
  uint16_t halves;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    stamp(period, halves);
    counted = periods;
    start = time_us;
  }
  return 2 * start + (uint8_t)(period - counted) * (uint32_t)HALVES + halves;
}

}  // namespace ticker

ISR(TIMER3_COMPA_vect) {
  using namespace ticker;
  periods = periods + 1;
  time_us += PERIOD_US;
  encoders::latch(latched);
  latched_period = periods;
  fresh = true;
}
