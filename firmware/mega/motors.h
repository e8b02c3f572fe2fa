// The motor driver: PWM at 20 kHz, too high to hear, and direction pins.
#pragma once
#include <Arduino.h>

#include "wheels.h"

namespace motors {

void begin();

// Drive a motor with a duty of -1000 to 1000 per mille, ahead is positive.
void set(Side side, float duty);

// Both off at once; may be called from an interrupt.
void off();

}  // namespace motors
