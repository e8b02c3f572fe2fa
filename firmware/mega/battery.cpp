#include "battery.h"

#include "config.h"

namespace battery {
namespace {

constexpr float PER_COUNT = BATTERY_REFERENCE_MV / 1024.0f * BATTERY_DIVIDER;
constexpr float SMOOTHING = 0.05f;    // of 5 ms: settles in 100 ms
constexpr uint16_t LOW_AFTER = 200;   // periods: 1 s, for motors starting pull it down a moment

static_assert(BATTERY_PIN >= 0 && BATTERY_PIN <= 7, "one of A0 to A7");

float mean = -1;
uint16_t low_for;

}  // namespace

void begin() {
  if (!BATTERY_WIRED) return;
  ADMUX = _BV(REFS0) | BATTERY_PIN;  // against 5 V
  ADCSRB = 0;
  ADCSRA = _BV(ADEN) | _BV(ADPS2) | _BV(ADPS1) | _BV(ADPS0);
  ADCSRA |= _BV(ADSC);
}

void tick() {
  if (!BATTERY_WIRED || (ADCSRA & _BV(ADSC))) return;
  float now = ADC * PER_COUNT;
  mean = mean < 0 ? now : mean + SMOOTHING * (now - mean);
  if (mean >= BATTERY_LOW_MV) low_for = 0;
  else if (low_for < LOW_AFTER) low_for++;
  ADCSRA |= _BV(ADSC);
}

uint16_t millivolts() { return mean < 0 ? 0 : mean > 65535 ? 65535 : (uint16_t)lroundf(mean); }

bool low() { return low_for == LOW_AFTER; }

}  // namespace battery
