// Speed of a wheel, measured and controlled.
#pragma once
#include <Arduino.h>

// Ticks/s from the times of edges: as fine at a few ticks/s as at thousands.
class Speedometer {
 public:
  // Count and newest edge at time now, in half microseconds.
  void update(int32_t count, uint32_t edge, uint32_t now);
  float speed() const { return speed_; }
  // Ticks that the wheel has gone on since the call before, parts of a tick among them.
  float moved() const { return moved_; }

 private:
  int32_t count_ = 0;  // at the edge that the measurement goes on from
  uint32_t time_ = 0;  // of that edge
  float speed_ = 0;
  int32_t newest_ = 0;  // count
  float part_ = 0;      // of a tick beyond it
  float moved_ = 0;
};

// Whether a motor at nearly full power turns nothing: its wheel is blocked, or its encoder is dead and it races unseen.
class StallDetector {
 public:
  // To be called once a period with the count, and the duty in per mille that the motor has had since the call before.
  bool update(int32_t count, float duty);

 private:
  int32_t from_ = 0;  // count when it last turned, or had less power
  uint8_t periods_ = 0;
};

struct Gains {
  float kp, ki, kd, feed_forward;
};

// Feed-forward for the wanted speed, and a PID on how the wheel differs from a motor that answers as the model does. So
// a step neither overshoots nor winds the integral up, which only meets what the model does not know: load, battery.
class Controller {
 public:
  // Duty in per mille; to be called once a period with the speeds in ticks/s and the ticks of the period.
  float step(float wanted, float measured, float moved, const Gains &gains);
  void reset() { running_ = false; }

 private:
  bool running_ = false;
  float model_;   // ticks/s
  float behind_;  // ticks
  float before_;
};
