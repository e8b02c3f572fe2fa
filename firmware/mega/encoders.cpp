#include "encoders.h"

#include <util/atomic.h>

#include "config.h"
#include "ticker.h"

namespace encoders {
namespace {

constexpr bool on_port_d(uint8_t pin) { return pin == 18 || pin == 19; }
constexpr uint8_t bit_of(uint8_t pin) { return pin == 2 ? 4 : pin == 3 ? 5 : pin == 18 ? 3 : 2; }
constexpr bool pair(uint8_t a, uint8_t b) { return (a == 2 && b == 3) || (a == 3 && b == 2) || (a == 18 && b == 19) || (a == 19 && b == 18); }
static_assert(pair(ENCODER_LEFT_A, ENCODER_LEFT_B) && pair(ENCODER_RIGHT_A, ENCODER_RIGHT_B) &&
                  on_port_d(ENCODER_LEFT_A) != on_port_d(ENCODER_RIGHT_A),
              "one encoder on pins 2 and 3, the other on 18 and 19");

struct Wheel {
  int16_t count;
  uint8_t state;  // of the channels: A is bit 1, B is bit 0
  int8_t direction;
  uint8_t period;
  uint16_t halves;
};
Wheel wheels[2];
volatile bool skipped;

// Ahead, A leads B: 11, 01, 00, 10. Index: old state * 4 + new state. 2: both channels have changed.
const int8_t STEP[16] = {0, -1, 1, 2, 1, 0, 2, -1, -1, 2, 0, 1, 2, 1, -1, 0};

template <uint8_t A, uint8_t B>
inline __attribute__((always_inline)) uint8_t channels() {
  uint8_t port = on_port_d(A) ? PIND : PINE;
  uint8_t state = 0;
  if (port & _BV(bit_of(A))) state |= 2;
  if (port & _BV(bit_of(B))) state |= 1;
  return state;
}

template <Side side>
inline __attribute__((always_inline)) uint8_t channels_of() {
  return side == LEFT ? channels<ENCODER_LEFT_A, ENCODER_LEFT_B>() : channels<ENCODER_RIGHT_A, ENCODER_RIGHT_B>();
}

template <Side side>
inline __attribute__((always_inline)) void edge() {
  constexpr int8_t sign = side == LEFT ? ENCODER_LEFT_SIGN : ENCODER_RIGHT_SIGN;
  Wheel &wheel = wheels[side];
  uint8_t state = channels_of<side>();
  int8_t step = STEP[(uint8_t)(wheel.state << 2) | state];
  // The other channel's interrupt has seen this edge already.
  if (step == 0) return;
  wheel.state = state;
  if (step == 2) {
    skipped = true;
    step = 2 * wheel.direction;  // the likeliest
  } else {
    step = sign * step;
    wheel.direction = step;
  }
  wheel.count += step;
  ticker::stamp(wheel.period, wheel.halves);
}

}  // namespace

void begin() {
  const uint8_t pins[] = {ENCODER_LEFT_A, ENCODER_LEFT_B, ENCODER_RIGHT_A, ENCODER_RIGHT_B};
  for (uint8_t pin : pins) pinMode(pin, INPUT_PULLUP);
  EICRA |= _BV(ISC20) | _BV(ISC30);  // any edge
  EICRB |= _BV(ISC40) | _BV(ISC50);
  delayMicroseconds(20);  // until the pull-ups have charged the lines
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    wheels[LEFT].state = channels_of<LEFT>();
    wheels[RIGHT].state = channels_of<RIGHT>();
    EIFR = _BV(INTF2) | _BV(INTF3) | _BV(INTF4) | _BV(INTF5);
    EIMSK |= _BV(INT2) | _BV(INT3) | _BV(INT4) | _BV(INT5);
  }
}

void latch(Latch *both) {
  for (uint8_t side = 0; side < 2; side++) both[side] = {wheels[side].count, wheels[side].period, wheels[side].halves};
}

bool impossible_step() {
  bool was;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    was = skipped;
    skipped = false;
  }
  return was;
}

}  // namespace encoders

// INT2 is pin 19, INT3 pin 18, INT4 pin 2, INT5 pin 3.
constexpr Side PORT_D = encoders::on_port_d(ENCODER_LEFT_A) ? LEFT : RIGHT;
constexpr Side PORT_E = PORT_D == LEFT ? RIGHT : LEFT;
ISR(INT2_vect) { encoders::edge<PORT_D>(); }
ISR(INT3_vect, ISR_ALIASOF(INT2_vect));
ISR(INT4_vect) { encoders::edge<PORT_E>(); }
ISR(INT5_vect, ISR_ALIASOF(INT4_vect));
