// Firmware of the base: two wheels at the speeds that a computer asks for, and what encoders, IMU and battery say.
// To be edited for another robot: config.h. What it speaks: docs/base_protocol.md.
#include <avr/sleep.h>

#include "base.h"
#include "battery.h"
#include "encoders.h"
#include "guard.h"
#include "imu.h"
#include "link.h"
#include "motors.h"
#include "ticker.h"
#include "twi.h"

void setup() {
  motors::begin();
  guard::begin();
  encoders::begin();
  twi::begin();
  battery::begin();
  link::begin();
  ticker::begin();
  set_sleep_mode(SLEEP_MODE_IDLE);
  base::begin();
}

void loop() {
  uint8_t *body;
  while (uint8_t length = link::receive(body)) base::obey(body, length);
  ticker::Sample sample;
  if (ticker::take(sample)) {
    guard::alive();
    imu::tick();
    battery::tick();
    base::step(sample);
  }
  imu::poll();

  // Until there is something to do. What comes just now is seen before, not after, the sleep.
  cli();
  while (!ticker::waiting() && !link::waiting() && !imu::waiting()) {
    sleep_enable();
    sei();
    sleep_cpu();
    sleep_disable();
    cli();
  }
  sei();
}
