#include "base.h"

#include <math.h>

#include "battery.h"
#include "config.h"
#include "encoders.h"
#include "frame.h"
#include "guard.h"
#include "imu.h"
#include "link.h"
#include "motors.h"
#include "protocol.h"
#include "speed.h"

namespace base {
namespace {

constexpr uint8_t PERIODS_PER_STATE = protocol::STATE_MS * 1000 / ticker::PERIOD_US;
constexpr uint32_t WATCHDOG = protocol::WATCHDOG_MS * 2000UL;  // half microseconds

enum class Mode : uint8_t { STOPPED, DRIVING, EXPIRED, STALLED };

Mode mode;
Gains gains = {GAIN_KP, GAIN_KI, GAIN_KD, GAIN_FEED_FORWARD};
int32_t wanted[2];
uint32_t driven_at;
uint8_t last_sequence;

Speedometer speedometers[2];
Controller controllers[2];
StallDetector stalls[2];
int32_t ticks[2];
int16_t counts[2];
float duties[2];
uint8_t until_state;

void stop(Mode why) {
  mode = why;
  motors::off();
  for (uint8_t side = 0; side < 2; side++) {
    controllers[side].reset();
    duties[side] = 0;
  }
}

template <typename Message>
bool send(Message &message, uint8_t type, bool may_be_left_out) {
  message.head.type = type;
  return link::send((uint8_t *)&message, sizeof message, may_be_left_out);
}

void acknowledge(uint8_t sequence, protocol::Result result) {
  protocol::Ack ack;
  ack.of = sequence;
  ack.result = result;
  send(ack, protocol::ACK, true);
}

void greet() {
  protocol::HelloReply reply;
  reply.version = protocol::VERSION;
  memcpy(reply.firmware, protocol::FIRMWARE, 3);
  reply.state_ms = protocol::STATE_MS;
  reply.watchdog_ms = protocol::WATCHDOG_MS;
  reply.imu_kind = imu::kind();
  reply.reset_cause = guard::reset_cause();
  reply.gains = {gains.kp, gains.ki, gains.kd, gains.feed_forward};
  send(reply, protocol::HELLO_REPLY, true);
}

bool drive(const uint8_t *payload) {
  protocol::Drive message;
  memcpy(&message, payload, sizeof message);
  const int32_t speeds[] = {message.left, message.right};
  for (int32_t speed : speeds)
    if (speed < -protocol::FASTEST || speed > protocol::FASTEST) return false;
  wanted[LEFT] = message.left;
  wanted[RIGHT] = message.right;
  driven_at = ticker::now();
  // Who goes on asking has not noticed that a motor does not turn; only asking for rest ends that.
  bool rest = message.left == 0 && message.right == 0;
  if (mode != Mode::STALLED || rest) mode = Mode::DRIVING;
  return true;
}

bool tune(const uint8_t *payload) {
  float values[4];
  memcpy(values, payload, sizeof values);
  for (float value : values)
    if (!(value >= 0 && value <= protocol::LARGEST_GAIN)) return false;  // a NaN fails too
  gains = {values[0], values[1], values[2], values[3]};
  return true;
}

void control(const ticker::Sample &sample) {
  for (uint8_t side = 0; side < 2; side++) {
    ticks[side] += (int16_t)(sample.count[side] - counts[side]);
    counts[side] = sample.count[side];
    speedometers[side].update(ticks[side], sample.edge[side], sample.now);
  }
  // The sample may be a little older than the command.
  if (mode == Mode::DRIVING && (int32_t)(sample.now - driven_at) >= (int32_t)WATCHDOG) stop(Mode::EXPIRED);
  if (mode != Mode::DRIVING) return;
  for (uint8_t side = 0; side < 2; side++)
    if (stalls[side].update(ticks[side], duties[side])) return stop(Mode::STALLED);
  for (uint8_t side = 0; side < 2; side++) {
    const Speedometer &wheel = speedometers[side];
    duties[side] = controllers[side].step(wanted[side], wheel.speed(), wheel.moved(), gains);
    motors::set((Side)side, duties[side]);
  }
}

void tell(uint32_t time_us) {
  protocol::State state;
  state.time_us = time_us;
  imu::Reading reading = imu::read();
  for (uint8_t i = 0; i < 3; i++) {
    state.gyro[i] = reading.gyro[i];
    state.accel[i] = reading.accel[i];
    state.compass[i] = reading.compass[i];
  }
  for (uint8_t side = 0; side < 2; side++) {
    state.ticks[side] = ticks[side];
    state.duty[side] = lroundf(duties[side]);
  }
  state.battery_mv = battery::millivolts();
  state.last_command_sequence = last_sequence;
  state.flags = (mode == Mode::EXPIRED ? protocol::WATCHDOG : 0) | (reading.answers ? protocol::IMU : 0) |
                (reading.compass_answers ? protocol::COMPASS : 0) | (battery::low() ? protocol::BATTERY_LOW : 0) |
                (link::refused() ? protocol::REFUSED : 0) |
                (encoders::impossible_step() ? protocol::IMPOSSIBLE_STEP : 0) |
                (mode == Mode::STALLED ? protocol::STALLED : 0);
  send(state, protocol::STATE, false);
}

}  // namespace

void begin() { greet(); }

void obey(const uint8_t *body, uint8_t length) {
  using namespace protocol;
  uint8_t type = body[0], sequence = body[1], payload = length - frame::OVERHEAD;
  uint8_t right = type == DRIVE ? sizeof(Drive) : type == TUNE ? sizeof(Tune) : 0;
  Result result = OBEYED;
  if (type < DRIVE || type > HELLO) {
    result = UNKNOWN_TYPE;
  } else if (payload != right) {
    result = WRONG_LENGTH;
  } else if (type == DRIVE) {
    if (!drive(body + sizeof(Head))) result = OUT_OF_RANGE;
  } else if (type == TUNE) {
    if (!tune(body + sizeof(Head))) result = OUT_OF_RANGE;
  } else if (type == STOP) {
    stop(Mode::STOPPED);
  } else {
    greet();
  }
  if (result == OBEYED) last_sequence = sequence;
  else link::refuse();
  if (result != OBEYED || type == STOP || type == TUNE) acknowledge(sequence, result);
}

void step(const ticker::Sample &sample) {
  control(sample);
  if (until_state == 0) {
    until_state = PERIODS_PER_STATE;
    tell(sample.time_us);
  }
  until_state--;
}

}  // namespace base
