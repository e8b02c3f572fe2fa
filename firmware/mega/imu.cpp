#include "imu.h"

#include <math.h>

#include "config.h"
#include "twi.h"

namespace imu {
namespace {

// MPU-9250 register map, revision 1.6, and AK8963 datasheet.
constexpr uint8_t MPU = 0x68, AK = 0x0C;
constexpr uint8_t WHO_AM_I = 0x75, ACCEL_XOUT_H = 0x3B, AK_WIA = 0x00, AK_ST1 = 0x02, AK_ASAX = 0x10;
constexpr uint8_t AK_READY = 1, AK_OVERFLOW = 8;

constexpr float PER_SECOND_PER_LSB = 500.0f / 32768 * (float)M_PI / 180;  // rad/s; set to 500 deg/s
constexpr float GYRO = PER_SECOND_PER_LSB * 4096;
constexpr float ACCEL = 4.0f / 32768 * 9806.65f;  // mm/s^2; set to 4 g
constexpr float COMPASS = 1.5f;                   // 0.15 uT

// What to do one after the other, a step a period: read from a register, or write it; then wait some periods.
struct Step {
  uint8_t address, reg, value;
  bool reads;
  uint8_t wait;
};
const Step START[] = {
    {MPU, WHO_AM_I, 1, true, 0},
    {MPU, 0x6B, 0x80, false, 20},  // reset: 100 ms
    {MPU, 0x6B, 0x01, false, 10},  // awake, clock of the gyro
    {MPU, 0x19, 4, false, 0},      // 200 samples a second
    {MPU, 0x1A, 3, false, 0},      // gyro below 41 Hz
    {MPU, 0x1B, 1 << 3, false, 0},  // 500 deg/s
    {MPU, 0x1C, 1 << 3, false, 0},  // 4 g
    {MPU, 0x1D, 3, false, 0},       // accelerometer below 41 Hz
    {MPU, 0x37, 2, false, 1},       // the compass behind it comes to the bus
    {AK, AK_WIA, 1, true, 0},
    {AK, 0x0B, 1, false, 1},     // reset
    {AK, 0x0A, 0x0F, false, 1},  // its calibration can be read
    {AK, AK_ASAX, 3, true, 0},
    {AK, 0x0A, 0x00, false, 1},
    {AK, 0x0A, 0x16, false, 1},  // 16 bits, 100 times a second
};
constexpr uint8_t STEPS = sizeof START / sizeof START[0];
constexpr uint8_t FIRST_OF_COMPASS = 9;
constexpr uint8_t FIRST_SETTING = 3, SETTINGS = 4;  // in registers side by side
constexpr uint8_t READ_AGAIN = 200;     // periods until it is looked for again: 1 s
constexpr uint8_t COMPASS_EVERY = 4;    // periods
constexpr uint8_t CHECK_EVERY = 20;     // periods
constexpr uint8_t FAILURES = 3;         // in a row, and it is gone
constexpr uint8_t STALE = 25;           // readings of the compass without news: 0.5 s

enum class At : uint8_t { STARTING, RUNNING };
enum class Asked : uint8_t { NOTHING, STEP, MOTION, FIELD, CHECK };

At at;
Asked asked;
uint8_t step, wait, late, failures, compass_failures, compass_due, check_due;
Kind found;
bool compass_runs;

int32_t sums[6];  // gyro, accel
uint8_t sum_count;
int16_t means[6];
int16_t field[3];
float adjust[3];

int16_t big(const uint8_t *two) { return (int16_t)(two[0] << 8 | two[1]); }
int16_t little(const uint8_t *two) { return (int16_t)(two[1] << 8 | two[0]); }

int16_t fit(float value) { return constrain(lroundf(value), -32768L, 32767L); }

float axis(const float *sensor, int8_t which) { return which > 0 ? sensor[which - 1] : -sensor[-which - 1]; }

// From the axes printed on the part to the robot's.
void turn(const float *sensor, int16_t *base) {
  base[0] = fit(axis(sensor, IMU_AHEAD));
  base[1] = fit(axis(sensor, IMU_LEFT));
  base[2] = fit(axis(sensor, IMU_UP));
}

void ask(Asked what) {
  asked = what;
  late = 0;
}

void look_again(uint8_t periods) {
  at = At::STARTING;
  asked = Asked::NOTHING;
  step = 0;
  wait = periods;
  found = NONE;
  compass_runs = false;
  sum_count = 0;
  memset(sums, 0, sizeof sums);
  memset(means, 0, sizeof means);
  memset(field, 0, sizeof field);
}

void run() {
  at = At::RUNNING;
  found = compass_runs ? WITH_COMPASS : WITHOUT_COMPASS;
  failures = compass_failures = compass_due = 0;
  check_due = CHECK_EVERY;
}

// What a step of the start has brought; whether to go on.
bool accept(const uint8_t *data) {
  if (step == 0) return *data == 0x71 || *data == 0x73 || *data == 0x70 || *data == 0x68;
  if (START[step].reg == AK_WIA) return *data == 0x48;
  if (START[step].reg == AK_ASAX)
    for (uint8_t i = 0; i < 3; i++) adjust[i] = COMPASS * ((data[i] - 128) / 256.0f + 1);
  return true;
}

void stepped(bool done) {
  const Step &was = START[step];
  if (done && (!was.reads || accept(twi::data()))) {
    wait = was.wait;
    compass_runs = step == STEPS - 1;
    if (++step == STEPS) run();
  } else if (step < FIRST_OF_COMPASS) {
    look_again(READ_AGAIN);
  } else {
    run();  // without a compass
  }
}

void moved(bool done) {
  if (!done) {
    if (++failures == FAILURES) look_again(READ_AGAIN);
    return;
  }
  failures = 0;
  const uint8_t *data = twi::data();
  for (uint8_t i = 0; i < 3; i++) {
    sums[i] += big(data + 8 + 2 * i);
    sums[3 + i] += big(data + 2 * i);
  }
  sum_count++;
}

// A part whose plug had a bad moment answers as before, but has forgotten its settings.
void checked(bool done) {
  const uint8_t *data = twi::data();
  for (uint8_t i = 0; i < SETTINGS; i++)
    if (!done || data[i] != START[FIRST_SETTING + i].value) return look_again(0);
}

void compass_read(bool done) {
  const uint8_t *data = twi::data();
  if (done && (data[0] & AK_READY) && !(data[7] & AK_OVERFLOW)) {
    compass_failures = 0;
    for (uint8_t i = 0; i < 3; i++) field[i] = little(data + 1 + 2 * i);
  } else if (compass_failures < STALE) {
    // An unplugged one is gone at once, one that has no news yet gets time.
    compass_failures += done ? 1 : STALE / FAILURES + 1;
    if (compass_failures >= STALE) memset(field, 0, sizeof field);
  }
}

}  // namespace

void tick() {
  if (compass_due) compass_due--;
  if (check_due) check_due--;
  if (asked != Asked::NOTHING) {
    // Two periods are twenty times what a transfer needs.
    if (++late == 2) twi::give_up();
    return;
  }
  if (wait) {
    wait--;
  } else if (at == At::STARTING) {
    const Step &next = START[step];
    ask(Asked::STEP);
    if (next.reads) twi::read(next.address, next.reg, next.value);
    else twi::write(next.address, next.reg, next.value);
  } else {
    ask(Asked::MOTION);
    twi::read(MPU, ACCEL_XOUT_H, 14);
  }
}

bool waiting() { return asked != Asked::NOTHING && twi::status() != twi::BUSY; }

void poll() {
  if (!waiting()) return;
  Asked was = asked;
  asked = Asked::NOTHING;
  bool done = twi::status() == twi::DONE;
  if (was == Asked::STEP) stepped(done);
  if (was == Asked::MOTION) moved(done);
  if (was == Asked::FIELD) compass_read(done);
  if (was == Asked::CHECK) checked(done);
  if (was != Asked::MOTION || !done) return;
  if (!check_due) {
    check_due = CHECK_EVERY;
    ask(Asked::CHECK);
    twi::read(MPU, START[FIRST_SETTING].reg, SETTINGS);
  } else if (compass_runs && !compass_due) {
    compass_due = COMPASS_EVERY;
    ask(Asked::FIELD);
    twi::read(AK, AK_ST1, 8);
  }
}

Reading read() {
  Reading reading = {};
  reading.answers = at == At::RUNNING;
  if (!reading.answers) return reading;
  if (sum_count) {
    for (uint8_t i = 0; i < 6; i++) {
      means[i] = lroundf((float)sums[i] / sum_count);
      sums[i] = 0;
    }
    sum_count = 0;
  }
  float sensor[3];
  for (uint8_t i = 0; i < 3; i++) sensor[i] = means[i] * GYRO;
  turn(sensor, reading.gyro);
  for (uint8_t i = 0; i < 3; i++) sensor[i] = means[3 + i] * ACCEL;
  turn(sensor, reading.accel);
  reading.compass_answers = compass_runs && compass_failures < STALE;
  // The compass is mounted in the part with x and y exchanged and z down.
  sensor[0] = field[1] * adjust[1];
  sensor[1] = field[0] * adjust[0];
  sensor[2] = -field[2] * adjust[2];
  turn(sensor, reading.compass);
  return reading;
}

Kind kind() { return found; }

}  // namespace imu
