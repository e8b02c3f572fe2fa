#include "speed.h"

#include "config.h"
#include "ticker.h"

namespace {
constexpr float PER_SECOND = 2e6f;          // half microseconds
constexpr uint32_t AT_MOST = 40000;         // 20 ms: what has come by then is measured ...
constexpr int32_t CYCLE = 4;                // ... or a whole cycle of the encoder, whose edges may be uneven
constexpr uint32_t STANDSTILL = 400000;     // 200 ms without an edge: less than 5 ticks/s
constexpr float FULL = 1000;                // per mille
constexpr float NEARLY_FULL = 900;
constexpr int32_t DITHER = 1;               // an encoder with one dead channel goes to and fro by a tick
constexpr uint8_t STALL = 500000UL / ticker::PERIOD_US;
constexpr float DT = ticker::PERIOD_US * 1e-6f;
constexpr float FOLLOWS = DT / (DT + MOTOR_TIME_CONSTANT);
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
  // Since its newest edge the wheel has gone on, but not as far as the next.
  float part = constrain(speed_ / PER_SECOND * (int32_t)(now - edge), -1.0f, 1.0f);
  moved_ = (count - newest_) + (part - part_);
  newest_ = count;
  part_ = part;
}

bool StallDetector::update(int32_t count, float duty) {
  if (fabs(duty) < NEARLY_FULL || abs(count - from_) > DITHER) {
    from_ = count;
    periods_ = 0;
    return false;
  }
  return ++periods_ >= STALL;
}

float Controller::step(float wanted, float measured, float moved, const Gains &gains) {
  if (!running_) {
    model_ = before_ = measured;
    behind_ = 0;
    running_ = true;
  }
  model_ += (wanted - model_) * FOLLOWS;
  if (fabs(wanted - model_) < 1) model_ = wanted;
  float slope = (measured - before_) / DT;
  before_ = measured;
  if (wanted == 0 && model_ == 0 && measured == 0) {
    behind_ = 0;
    return 0;  // no hum at rest
  }
  // The integral of the speed's error is counted, not measured: the mean speed is exact.
  float behind = behind_ + model_ * DT - moved;
  float direct = gains.feed_forward * wanted + gains.kp * (model_ - measured) - gains.kd * slope;
  if (wanted > 0) direct += MOTOR_DEAD_BAND;
  if (wanted < 0) direct -= MOTOR_DEAD_BAND;
  float duty = direct + gains.ki * behind;
  bool grows = fabs(behind) > fabs(behind_);
  if (fabs(duty) > FULL && grows && (duty > 0) == (behind > 0)) duty = direct + gains.ki * behind_;
  else behind_ = behind;
  return constrain(duty, -FULL, FULL);
}
