// MPU-9250 (or MPU-6500, MPU-6050, without a compass) on the I2C bus, looked for again and again while it is not there.
#pragma once
#include <Arduino.h>

namespace imu {

enum Kind : uint8_t { NONE, WITH_COMPASS, WITHOUT_COMPASS };

// In the base frame (x ahead, y left, z up), units of docs/base_protocol.md. What does not answer is 0.
struct Reading {
  int16_t gyro[3], accel[3], compass[3];
  bool answers, compass_answers;
};

// Once a period.
void tick();
// When a transfer has ended.
void poll();
bool waiting();

// The mean since the last call, and the newest of the compass.
Reading read();
Kind kind();

}  // namespace imu
