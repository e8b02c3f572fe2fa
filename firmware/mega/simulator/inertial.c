/* Registers as in the MPU-9250 register map (revision 1.6) and the AK8963 datasheet; what the firmware may use of them. */
#include "inertial.h"

#include <math.h>
#include <string.h>

#include "avr_ioport.h"
#include "avr_twi.h"
#include "fail.h"

enum {
	PORTD = 0x2B, SCL = 1, TWSR = 0xB9, TWCR = 0xBC, TWIE = 1, /* the chip's */
	MOTION = 0x68, COMPASS = 0x0C,
	GYRO_CONFIG = 0x1B, ACCEL_CONFIG = 0x1C, INT_PIN_CFG = 0x37, ACCEL_XOUT_H = 0x3B, GYRO_XOUT_H = 0x43,
	PWR_MGMT_1 = 0x6B, WHO_AM_I = 0x75,
	WIA = 0x00, ST1 = 0x02, HXL = 0x03, ST2 = 0x09, CNTL1 = 0x0A, CNTL2 = 0x0B, ASAX = 0x10,
};
static const uint8_t ADJUSTMENTS[3] = {180, 172, 163};

static void reset_compass(inertial_t *part) {
	memset(part->compass, 0, sizeof part->compass);
	part->compass[WIA] = 0x48;
}

static void reset_motion(inertial_t *part) {
	memset(part->motion, 0, sizeof part->motion);
	part->motion[PWR_MGMT_1] = 0x40; /* asleep, as the older parts of the family are */
	part->motion[WHO_AM_I] = part->kind == INERTIAL_MPU9250 ? 0x71 : 0x70;
}

/* A vector of the base frame in the axes printed on the part. */
static void to_sensor(const inertial_t *part, const int16_t *base, double *sensor) {
	for (int i = 0; i < 3; i++) {
		int which = part->axes[i];
		sensor[(which < 0 ? -which : which) - 1] = which < 0 ? -base[i] : base[i];
	}
}

static int16_t fit(double value) {
	return value > 32767 ? 32767 : value < -32768 ? -32768 : (int16_t)lround(value);
}

static void measure_motion(inertial_t *part) {
	double accel[3], gyro[3];
	to_sensor(part, part->values, gyro);
	to_sensor(part, part->values + 3, accel);
	double gyro_range = 250 << (part->motion[GYRO_CONFIG] >> 3 & 3);
	double accel_range = 2 << (part->motion[ACCEL_CONFIG] >> 3 & 3);
	for (int i = 0; i < 3; i++) {
		int16_t a = fit(accel[i] / 9806.65 / accel_range * 32768);
		int16_t g = fit(gyro[i] / 4096 * 180 / M_PI / gyro_range * 32768);
		if (part->motion[PWR_MGMT_1] & 0x40) a = g = 0;
		part->motion[ACCEL_XOUT_H + 2 * i] = (uint16_t)a >> 8;
		part->motion[ACCEL_XOUT_H + 2 * i + 1] = a & 255;
		part->motion[GYRO_XOUT_H + 2 * i] = (uint16_t)g >> 8;
		part->motion[GYRO_XOUT_H + 2 * i + 1] = g & 255;
	}
}

static void measure_field(inertial_t *part) {
	uint8_t mode = part->compass[CNTL1] & 15;
	avr_cycle_count_t every = part->avr->frequency / 100;
	if (mode == 0x0F) memcpy(part->compass + ASAX, ADJUSTMENTS, 3);
	else memset(part->compass + ASAX, 0, 3);
	if (mode != 0x06 || part->avr->cycle - part->compass_read < every) return;
	part->compass_read = part->avr->cycle;
	double printed[3];
	to_sensor(part, part->values + 6, printed);
	/* Inside the part the compass lies with x and y exchanged and z down. */
	double own[3] = {printed[1], printed[0], -printed[2]};
	double per_lsb = part->compass[CNTL1] & 0x10 ? 1.5 : 6.0;
	for (int i = 0; i < 3; i++) {
		int16_t h = fit(own[i] / per_lsb / ((ADJUSTMENTS[i] - 128) / 256.0 + 1));
		part->compass[HXL + 2 * i] = h & 255;
		part->compass[HXL + 2 * i + 1] = (uint16_t)h >> 8;
	}
	part->compass[ST1] |= 1;
	part->compass[ST2] = part->compass[CNTL1] & 0x10;
}

static bool answers(const inertial_t *part, uint8_t address) {
	if (!part->plugged || part->kind == INERTIAL_NONE) return false;
	if (address == MOTION) return true;
	return address == COMPASS && part->kind == INERTIAL_MPU9250 && (part->motion[INT_PIN_CFG] & 2);
}

static void store(inertial_t *part, uint8_t value) {
	bool motion = part->addressed >> 1 == MOTION;
	uint8_t at = part->pointer++ & (motion ? 127 : 31);
	if (motion && at == PWR_MGMT_1 && (value & 0x80)) reset_motion(part);
	else if (motion && at != WHO_AM_I) part->motion[at] = value;
	else if (!motion && at == CNTL2 && (value & 1)) reset_compass(part);
	else if (!motion && at == CNTL1) part->compass[CNTL1] = value;
}

static uint8_t fetch(inertial_t *part) {
	if (part->addressed >> 1 == MOTION) return part->motion[part->pointer++ & 127];
	uint8_t at = part->pointer++ & 31, value = part->compass[at];
	if (at == ST2) part->compass[ST1] &= ~1;
	return value;
}

static void on_bus(struct avr_irq_t *irq, uint32_t value, void *param) {
	(void)irq;
	inertial_t *part = param;
	avr_twi_msg_irq_t message = {.u.v = value};
	uint8_t what = message.u.twi.msg;
	part->only_addressed = (what & TWI_COND_START) && !(message.u.twi.addr & 1);
	if (what & TWI_COND_STOP) part->addressed = 0;
	if (what & TWI_COND_START) {
		part->addressed = part->clocks = 0;
		if (!answers(part, message.u.twi.addr >> 1)) return;
		part->addressed = message.u.twi.addr;
		part->pointed = false;
		if (message.u.twi.addr & 1) {
			measure_motion(part);
			measure_field(part);
		}
		avr_raise_irq(part->to_bus, avr_twi_irq_msg(TWI_COND_ACK, part->addressed, 1));
	}
	if (!part->addressed || !part->plugged) return;
	if (what & TWI_COND_WRITE) {
		avr_raise_irq(part->to_bus, avr_twi_irq_msg(TWI_COND_ACK, part->addressed, 1));
		if (part->pointed) store(part, message.u.twi.data);
		else part->pointer = message.u.twi.data;
		part->pointed = true;
	}
	if (what & TWI_COND_READ)
		avr_raise_irq(part->to_bus, avr_twi_irq_msg(TWI_COND_READ, part->addressed, fetch(part)));
}

/*
 * simavr 1.6 tells the chip after an address that it has sent data (0x28, 0x30), where the datasheet has 0x18 and 0x20.
 * This is called before the chip is interrupted, which it is not while the bus is held.
 */
static void on_status(struct avr_irq_t *irq, uint32_t status, void *param) {
	(void)irq;
	inertial_t *part = param;
	if (part->stuck) part->avr->data[TWCR] &= ~TWIE;
	if (part->only_addressed && (status == 0x28 || status == 0x30)) part->avr->data[TWSR] = status - 0x10;
}

/* The chip makes pins of port D outputs, or no longer: so it clocks a part out that holds the bus. */
static void on_direction(struct avr_irq_t *irq, uint32_t outputs, void *param) {
	(void)irq;
	inertial_t *part = param;
	bool low = outputs & SCL;
	if (low && (part->avr->data[PORTD] & SCL)) fail("SCL is driven high, against a part that may hold it low");
	if (low && !part->clock_low && ++part->clocks >= 9 && !part->stubborn) part->stuck = false;
	part->clock_low = low;
}

void inertial_plug(inertial_t *part, bool plugged) {
	if (plugged && !part->plugged) {
		reset_motion(part);
		reset_compass(part);
	}
	part->plugged = plugged;
}

void inertial_begin(inertial_t *part, avr_t *avr) {
	part->avr = avr;
	part->plugged = false;
	inertial_plug(part, true);
	part->to_bus = avr_io_getirq(avr, AVR_IOCTL_TWI_GETIRQ(0), TWI_IRQ_INPUT);
	avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_TWI_GETIRQ(0), TWI_IRQ_OUTPUT), on_bus, part);
	avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_TWI_GETIRQ(0), TWI_IRQ_STATUS), on_status, part);
	avr_irq_t *direction = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('D'), IOPORT_IRQ_DIRECTION_ALL);
	avr_irq_register_notify(direction, on_direction, part);
}
