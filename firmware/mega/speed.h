// Speed of a wheel, measured and controlled.
#pragma once
#include <Arduino.h>

// Ticks/s from the times of edges: as fine at a few ticks/s as at thousands.
class Speedometer {
 public:
  // Count and newest edge at time now, in half microseconds.
  void update(int32_t count, uint32_t edge, uint32_t now);
  float speed() const { return speed_; }

 private:
  int32_t count_ = 0;  // at the edge that the measurement goes on from
  uint32_t time_ = 0;  // of that edge
  float speed_ = 0;
};

struct Gains {
  float kp, ki, kd, feed_forward;
};

class Controller {
 public:
  // Duty in per mille for a wanted and a measured speed in ticks/s; to be called once a period.
  float step(float wanted, float measured, const Gains &gains);
  void reset();

 private:
  float integral_ = 0;
  float before_ = 0;
};
