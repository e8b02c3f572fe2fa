/* An MPU-9250 with its AK8963, or an MPU-6500, as the I2C bus of the simulated Mega sees it. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "sim_avr.h"

typedef enum { INERTIAL_NONE, INERTIAL_MPU9250, INERTIAL_MPU6500 } inertial_kind_t;

typedef struct {
	inertial_kind_t kind;
	bool plugged;
	/* Sensor axis (1, 2, 3; negative where it points the other way) along the base's x, y, z. */
	int8_t axes[3];
	/* Base frame: gyro (1/4096 rad/s), accelerometer (mm/s^2), compass (0.1 uT). */
	int16_t values[9];

	bool stuck;    /* it holds the bus, so that no transfer ends, until it is clocked nine times ... */
	bool stubborn; /* ... or goes on all the same */
	bool clock_low;
	uint8_t clocks; /* falling edges that the chip has made by itself on SCL since the newest start */

	avr_t *avr;
	avr_irq_t *to_bus;
	uint8_t motion[128], compass[32]; /* registers */
	uint8_t addressed;                /* with the bit for reading; 0 when nobody is */
	bool pointed;                     /* a register has been chosen since the start */
	bool only_addressed;              /* the newest thing on the bus was an address to write to */
	uint8_t pointer;
	avr_cycle_count_t compass_read; /* when its newest values were taken */
} inertial_t;

void inertial_begin(inertial_t *part, avr_t *avr);

/* As if its plug had been pulled or put in; a part that is put in knows nothing of before. */
void inertial_plug(inertial_t *part, bool plugged);
