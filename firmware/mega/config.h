// What differs from robot to robot. Everything a user edits is here; README.md beside this file tells how.
// A copy of it elsewhere can be taken instead: make CONFIG=/path/to/my_robot.h
#pragma once
#if defined(OTHER_CONFIG) && !defined(OTHER_CONFIG_TAKEN)
#define OTHER_CONFIG_TAKEN
#include OTHER_CONFIG
#else

// Motor driver (L298N, TB6612 and the like). PWM pins: any of 6, 7, 8, 44, 45, 46, both of one timer: 6-8 or 44-46.
// IN1 high and IN2 low is ahead. A driver with one direction pin: its number as IN1, NO_PIN as IN2.
#define NO_PIN 255
#define MOTOR_LEFT_PWM 6
#define MOTOR_LEFT_IN1 22
#define MOTOR_LEFT_IN2 23
#define MOTOR_RIGHT_PWM 7
#define MOTOR_RIGHT_IN1 24
#define MOTOR_RIGHT_IN2 25
// -1 where the wheel turns backwards when it is told to go ahead.
#define MOTOR_LEFT_SIGN 1
#define MOTOR_RIGHT_SIGN 1

// Encoders. Only 2, 3, 18 and 19 interrupt and are free; the two of a wheel are 2 and 3, or 18 and 19.
#define ENCODER_LEFT_A 18
#define ENCODER_LEFT_B 19
#define ENCODER_RIGHT_A 2
#define ENCODER_RIGHT_B 3
// -1 where the ticks fall when the wheel is turned ahead by hand.
#define ENCODER_LEFT_SIGN 1
#define ENCODER_RIGHT_SIGN 1

// Speed control: per mille of full duty per tick/s, per tick, per tick/s^2, per tick/s (see README.md, Tuning).
#define GAIN_KP 0.15f
#define GAIN_KI 2.5f
#define GAIN_KD 0.0f
#define GAIN_FEED_FORWARD 0.125f

// How fast the wheels follow, and shall: time until a step is 63 % done, s. Duty that only just does not turn a wheel.
#define MOTOR_TIME_CONSTANT 0.08f
#define MOTOR_DEAD_BAND 0.0f

// IMU on pins 20 (SDA) and 21 (SCL), address 0x68 (AD0 low). Which of its axes points ahead, to the left and up in
// the robot: 1, 2, 3 for the x, y, z printed on it; negative where the axis points the other way.
#define IMU_AHEAD 1
#define IMU_LEFT 2
#define IMU_UP 3

// Battery on an analogue pin behind a divider: 20 kOhm above 10 kOhm is 3.0, for up to 15 V.
#define BATTERY_WIRED 1
#define BATTERY_PIN 0  // A0; 0 to 7
#define BATTERY_DIVIDER 3.0f
#define BATTERY_REFERENCE_MV 5000  // the Mega's own 5 V, measured
#define BATTERY_LOW_MV 6600  // two lithium cells at 3.3 V

// 0 for an old boot loader (before 2012) that never comes back from a reset by the watchdog.
#define HARDWARE_WATCHDOG 1
#endif
