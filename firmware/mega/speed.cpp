#include "speed.h"

#include "ticker.h"

namespace {
constexpr float PER_SECOND = 2e6f;          // half microseconds
constexpr uint32_t AT_MOST = 40000;         // 20 ms: what has come by then is measured ...
constexpr int32_t CYCLE = 4;                // ... or a whole cycle of the encoder, whose edges may be uneven
constexpr uint32_t STANDSTILL = 400000;     // 200 ms without an edge: less than 5 ticks/s
constexpr float FULL = 1000;                // per mille
constexpr float DT = ticker::PERIOD_US * 1e-6f;
}  // namespace

void Speedometer::update(int32_t count, uint32_t edge, uint32_t now) {
  int32_t ticks = count - count_;
  uint32_t waited = now - time_;
  if (ticks != 0 && (abs(ticks) >= CYCLE || waited >= AT_MOST)) {
    int32_t took = edge - time_;
    if (took > 0) speed_ = ticks * PER_SECOND / took;
    count_ = count;
    time_ = edge;
  } else if (waited >= STANDSTILL) {
    speed_ = 0;
    time_ = now;  // the next measurement begins here, not when the wheel stopped
  } else if (waited > 0) {
    // The next edge is still to come, so the wheel cannot be faster than if it came now.
    float most = (abs(ticks) + 1) * PER_SECOND / waited;
    speed_ = constrain(speed_, -most, most);
  }
}

float Controller::step(float wanted, float measured, const Gains &gains) {
  float slope = (measured - before_) / DT;
  before_ = measured;
  if (wanted == 0 && measured == 0) {
    integral_ = 0;
    return 0;  // no hum at rest
  }
  float error = wanted - measured;
  float direct = gains.feed_forward * wanted + gains.kp * error - gains.kd * slope;
  float integral = integral_ + gains.ki * error * DT;
  float duty = direct + integral;
  // At the end of its range the integral only ever moves back in.
  if ((duty > FULL && error > 0) || (duty < -FULL && error < 0)) duty = direct + integral_;
  else integral_ = constrain(integral, -FULL, FULL);
  return constrain(duty, -FULL, FULL);
}

void Controller::reset() { integral_ = before_ = 0; }
