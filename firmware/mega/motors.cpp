#include "motors.h"

#include "config.h"

namespace motors {
namespace {

constexpr uint16_t TOP = 400;  // 16 MHz / 2 / 400 is 20 kHz

constexpr bool on_timer_4(uint8_t pin) { return pin >= 6 && pin <= 8; }
constexpr bool on_timer_5(uint8_t pin) { return pin >= 44 && pin <= 46; }
static_assert((on_timer_4(MOTOR_LEFT_PWM) && on_timer_4(MOTOR_RIGHT_PWM)) ||
                  (on_timer_5(MOTOR_LEFT_PWM) && on_timer_5(MOTOR_RIGHT_PWM)),
              "both PWM pins among 6, 7, 8, or both among 44, 45, 46");
static_assert(MOTOR_LEFT_PWM != MOTOR_RIGHT_PWM, "a PWM pin for each motor");

struct Motor {
  uint8_t pwm, in1, in2;
  int8_t sign;
};
const Motor MOTORS[2] = {{MOTOR_LEFT_PWM, MOTOR_LEFT_IN1, MOTOR_LEFT_IN2, MOTOR_LEFT_SIGN},
                         {MOTOR_RIGHT_PWM, MOTOR_RIGHT_IN1, MOTOR_RIGHT_IN2, MOTOR_RIGHT_SIGN}};
float carry[2];
int8_t direction[2];

volatile uint16_t &compare(uint8_t pin) {
  switch (pin) {
    case 6: return OCR4A;
    case 7: return OCR4B;
    case 8: return OCR4C;
    case 46: return OCR5A;
    case 45: return OCR5B;
    default: return OCR5C;
  }
}

uint8_t connect(uint8_t pin) {  // COMnx1: high until the comparison
  return pin == 6 || pin == 46 ? _BV(COM4A1) : pin == 7 || pin == 45 ? _BV(COM4B1) : _BV(COM4C1);
}

void point(Side side, int8_t to) {
  if (direction[side] == to) return;
  direction[side] = to;
  const Motor &motor = MOTORS[side];
  digitalWrite(motor.in1, to > 0);
  if (motor.in2 != NO_PIN) digitalWrite(motor.in2, to < 0);
}

}  // namespace

void begin() {
  // Phase-correct up to ICRn: a duty of nothing is really low, all of it really high.
  uint8_t connected = connect(MOTOR_LEFT_PWM) | connect(MOTOR_RIGHT_PWM) | _BV(WGM41);
  if (on_timer_4(MOTOR_LEFT_PWM)) {
    TCCR4B = 0;
    ICR4 = TOP;
    OCR4A = OCR4B = OCR4C = 0;
    TCCR4A = connected;
    TCCR4B = _BV(WGM43) | _BV(CS40);
  } else {
    TCCR5B = 0;
    ICR5 = TOP;
    OCR5A = OCR5B = OCR5C = 0;
    TCCR5A = connected;
    TCCR5B = _BV(WGM53) | _BV(CS50);
  }
  for (const Motor &motor : MOTORS) {
    pinMode(motor.in1, OUTPUT);
    if (motor.in2 != NO_PIN) pinMode(motor.in2, OUTPUT);
    pinMode(motor.pwm, OUTPUT);
  }
}

void set(Side side, float duty) {
  const Motor &motor = MOTORS[side];
  float wanted = motor.sign * duty * (TOP / 1000.0f);
  // What rounding took is given back next time, so that slow speeds are not held in steps of 2.5 per mille.
  int16_t steps = 0;
  if (duty == 0) {
    carry[side] = 0;
  } else {
    wanted += carry[side];
    steps = constrain(lroundf(wanted), -(int16_t)TOP, (int16_t)TOP);
    carry[side] = constrain(wanted - steps, -1.0f, 1.0f);
  }
  point(side, steps > 0 ? 1 : steps < 0 ? -1 : 0);
  compare(motor.pwm) = abs(steps);
}

void off() {
  for (uint8_t side = 0; side < 2; side++) {
    compare(MOTORS[side].pwm) = 0;
    point((Side)side, 0);
    carry[side] = 0;
  }
}

}  // namespace motors
