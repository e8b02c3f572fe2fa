// Messages of docs/base_protocol.md. The AVR is little-endian and aligns nothing, as the line has it.
#pragma once
#include <stdint.h>

namespace protocol {

constexpr uint8_t VERSION = 1;
constexpr uint8_t FIRMWARE[3] = {1, 1, 0};
constexpr uint16_t STATE_MS = 20, WATCHDOG_MS = 300;
constexpr int32_t FASTEST = 20000;  // ticks/s
constexpr float LARGEST_GAIN = 100;

enum Type : uint8_t { DRIVE = 0x01, STOP, TUNE, HELLO, STATE = 0x81, ACK, HELLO_REPLY };
enum Result : uint8_t { OBEYED, UNKNOWN_TYPE, WRONG_LENGTH, OUT_OF_RANGE };
enum Flag : uint8_t {
  WATCHDOG = 1, IMU = 2, COMPASS = 4, BATTERY_LOW = 8, REFUSED = 16, IMPOSSIBLE_STEP = 32, STALLED = 64
};

struct Head {
  uint8_t type, sequence;
};

struct Drive {
  int32_t left, right;
};

struct Tune {
  float kp, ki, kd, feed_forward;
};

struct State {
  Head head;
  uint32_t time_us;
  int32_t ticks[2];
  int16_t gyro[3], accel[3], compass[3];
  uint16_t battery_mv;
  int16_t duty[2];
  uint8_t last_command_sequence, flags;
  uint32_t crc;
};
static_assert(sizeof(State) == 44, "as on the line");

struct Ack {
  Head head;
  uint8_t of, result;
  uint32_t crc;
};

struct HelloReply {
  Head head;
  uint8_t version, firmware[3];
  uint16_t state_ms, watchdog_ms;
  uint8_t imu_kind, reset_cause;
  Tune gains;
  uint32_t crc;
};
static_assert(sizeof(HelloReply) == 32, "as on the line");

}  // namespace protocol
