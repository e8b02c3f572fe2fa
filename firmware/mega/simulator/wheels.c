#include "wheels.h"

#include <stdbool.h>
#include <stdlib.h>

#include "../config.h"
#include "avr_ioport.h"
#include "fail.h"

/* Port and bit of the Mega's pins 0 to 69. */
static const char PINS[] =
	"E0E1E4E5G5E3H3H4H5H6B4B5B6B7J1J0H1H0D3D2D1D0A0A1A2A3A4A5A6A7C7C6C5C4C3C2C1C0D7G2G1G0L7L6L5L4L3L2L1L0B3B2B1B0"
	"F0F1F2F3F4F5F6F7K0K1K2K3K4K5K6K7";

typedef struct {
	uint8_t a, b;
	int8_t sign;
	int32_t position;
	int32_t start, ticks; /* of this step: where it began, and how far it goes */
	uint32_t done;
	avr_irq_t *irq[2];
} encoder_t;

typedef struct {
	uint8_t pwm, in1, in2;
	int8_t sign;
} motor_t;

static encoder_t encoders[2] = {{.a = ENCODER_LEFT_A, .b = ENCODER_LEFT_B, .sign = ENCODER_LEFT_SIGN},
								{.a = ENCODER_RIGHT_A, .b = ENCODER_RIGHT_B, .sign = ENCODER_RIGHT_SIGN}};
static const motor_t MOTORS[2] = {{MOTOR_LEFT_PWM, MOTOR_LEFT_IN1, MOTOR_LEFT_IN2, MOTOR_LEFT_SIGN},
								  {MOTOR_RIGHT_PWM, MOTOR_RIGHT_IN1, MOTOR_RIGHT_IN2, MOTOR_RIGHT_SIGN}};

static avr_t *avr;
static avr_cycle_count_t step_start, step_cycles;

static char port_of(uint8_t pin) { return PINS[2 * pin]; }
static uint8_t bit_of(uint8_t pin) { return PINS[2 * pin + 1] - '0'; }

/* Whether a pin is an output, and high. */
static bool high(uint8_t pin) {
	avr_ioport_state_t state;
	avr_ioctl(avr, AVR_IOCTL_IOPORT_GETSTATE(port_of(pin)), &state);
	return state.port & state.ddr & 1 << bit_of(pin);
}

static bool is_output(uint8_t pin) {
	avr_ioport_state_t state;
	avr_ioctl(avr, AVR_IOCTL_IOPORT_GETSTATE(port_of(pin)), &state);
	return state.ddr & 1 << bit_of(pin);
}

/* A leads B when the wheel goes ahead; both are high at position 0, as the pull-ups leave them. */
static void channels(const encoder_t *encoder, uint32_t *levels) {
	int phase = encoder->sign * encoder->position & 3;
	levels[0] = phase == 0 || phase == 3;
	levels[1] = phase <= 1;
}

static void set_pins(encoder_t *encoder) {
	uint32_t levels[2];
	channels(encoder, levels);
	avr_raise_irq(encoder->irq[0], levels[0]);
	avr_raise_irq(encoder->irq[1], levels[1]);
}

static avr_cycle_count_t edge_after(const encoder_t *encoder, uint32_t done) {
	uint64_t count = abs(encoder->ticks);
	return done < count ? step_start + step_cycles * (2 * done + 1) / (2 * count) : 0;
}

static avr_cycle_count_t on_edge(struct avr_t *of, avr_cycle_count_t when, void *param) {
	(void)of, (void)when;
	encoder_t *encoder = param;
	encoder->done++;
	encoder->position = encoder->start + (encoder->ticks > 0 ? 1 : -1) * (int32_t)encoder->done;
	set_pins(encoder);
	return edge_after(encoder, encoder->done);
}

static void start_edges(encoder_t *encoder, int32_t position) {
	encoder->start = encoder->position;
	encoder->ticks = position - encoder->position;
	encoder->done = 0;
	if (encoder->ticks) avr_cycle_timer_register(avr, edge_after(encoder, 0) - avr->cycle, on_edge, encoder);
}

static uint16_t word(uint16_t address) { return avr->data[address] | avr->data[address + 1] << 8; }

/* Share of the time that a PWM pin is high, per mille, from the registers of timer 4 or 5. */
static int pwm(uint8_t pin) {
	if (!is_output(pin)) return 0;
	uint16_t timer = pin <= 8 ? 0xA0 : 0x120; /* TCCRnA */
	int channel = pin == 6 || pin == 46 ? 0 : pin == 7 || pin == 45 ? 1 : 2;
	bool connected = avr->data[timer] & 0x80 >> 2 * channel;
	uint8_t wave = (avr->data[timer] & 3) | (avr->data[timer + 1] >> 1 & 12);
	uint16_t top = word(timer + 6), compare = word(timer + 8 + 2 * channel);
	if (!connected) return high(pin) ? 1000 : 0;
	if (!(avr->data[timer + 1] & 7)) fail("the PWM timer has no clock");
	if (wave != 8 && wave != 10) fail("the PWM timer is in a mode that is not modelled: only 8 and 10 are");
	if (!top) return 0;
	return compare >= top ? 1000 : (compare * 2000 + top) / (2 * top);
}

int16_t wheels_duty(int side) {
	const motor_t *motor = &MOTORS[side];
	bool ahead = high(motor->in1), back = motor->in2 == NO_PIN ? !ahead : high(motor->in2);
	return ahead == back ? 0 : motor->sign * (ahead ? 1 : -1) * pwm(motor->pwm);
}

/*
 * Only the registers of the PWM timers are looked at. Were they to run, their 80,000 events a second, which nobody
 * waits for, would take half of the time: they are plain memory.
 */
static void freeze_pwm_timers(void) {
	for (int timer = 0xA0; timer <= 0x120; timer += 0x80)
		for (int address = timer; address <= timer + 13; address++) avr->io[AVR_DATA_TO_IO(address)].w.c = NULL;
}

void wheels_restore(void) {
	for (int side = 0; side < 2; side++) {
		uint32_t levels[2];
		channels(&encoders[side], levels);
		const uint8_t pins[2] = {encoders[side].a, encoders[side].b};
		for (int i = 0; i < 2; i++) {
			uint16_t address = port_of(pins[i]) == 'D' ? 0x29 : 0x2C; /* PIND, PINE */
			if (levels[i]) avr->data[address] |= 1 << bit_of(pins[i]);
		}
	}
}

void wheels_turn(const int32_t *positions, avr_cycle_count_t cycles) {
	step_start = avr->cycle;
	step_cycles = cycles;
	for (int side = 0; side < 2; side++) start_edges(&encoders[side], positions[side]);
}

void wheels_arrive(void) {
	for (int side = 0; side < 2; side++) {
		avr_cycle_timer_cancel(avr, on_edge, &encoders[side]);
		while (encoders[side].done < (uint32_t)abs(encoders[side].ticks)) on_edge(avr, 0, &encoders[side]);
	}
}

void wheels_begin(avr_t *of) {
	avr = of;
	freeze_pwm_timers();
	for (int side = 0; side < 2; side++) {
		encoder_t *encoder = &encoders[side];
		encoder->irq[0] = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(port_of(encoder->a)), bit_of(encoder->a));
		encoder->irq[1] = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(port_of(encoder->b)), bit_of(encoder->b));
		set_pins(encoder);
	}
}
