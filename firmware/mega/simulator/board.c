/*
 * An Arduino Mega 2560 in simavr that runs the real firmware, in lock step with whoever simulates the robot around it.
 * Wired as config.h says. Each request on standard input is answered by one reply on standard output, little-endian:
 *
 *   request: u32 step (us), i32 left, i32 right (encoder positions to reach, in ticks, edges spread evenly),
 *            i16[9] gyro, accelerometer, compass (base frame, units of docs/base_protocol.md), u16 battery (mV),
 *            u16 n, n bytes for UART0
 *   reply:   u64 cycles since the start, i16[2] duty of the left and the right motor (per mille, as the motor driver
 *            sees it on its pins), u16 m, m bytes that UART0 has sent
 *
 * At the end of standard input a line of figures in JSON goes to standard error.
 */
#include <getopt.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../config.h"
#include "avr_adc.h"
#include "avr_ioport.h"
#include "avr_uart.h"
#include "inertial.h"
#include "sim_avr.h"
#include "sim_elf.h"
#include "sim_interrupts.h"

enum { MHZ = 16, BYTE_CYCLES = MHZ * 10 * 1000000 / 115200, WAITING = 1 << 18 };

/* Port and bit of the Mega's pins 0 to 69. */
static const char PINS[] =
	"E0E1E4E5G5E3H3H4H5H6B4B5B6B7J1J0H1H0D3D2D1D0A0A1A2A3A4A5A6A7C7C6C5C4C3C2C1C0D7G2G1G0L7L6L5L4L3L2L1L0B3B2B1B0"
	"F0F1F2F3F4F5F6F7K0K1K2K3K4K5K6K7";

typedef struct __attribute__((packed)) {
	uint32_t step_us;
	int32_t position[2];
	int16_t imu[9];
	uint16_t battery_mv, bytes;
} request_t;

typedef struct __attribute__((packed)) {
	uint64_t cycles;
	int16_t duty[2];
	uint16_t bytes;
} reply_t;

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
static inertial_t inertial = {.kind = INERTIAL_MPU9250, .axes = {IMU_AHEAD, IMU_LEFT, IMU_UP}};
static avr_cycle_count_t step_start, step_cycles;

static avr_irq_t *uart_in;
static uint8_t to_board[WAITING], from_board[65535];
static uint32_t to_head, to_tail, from_count;

static avr_cycle_count_t asleep, in_interrupts, interrupt_start, longest_interrupt;
static unsigned resets;
static bool boot_loader; /* there is one, which hides why the chip was reset */
static double hang_at = -1, unplug_at = -1, plug_at = -1, stick_at = -1, free_at = -1, poke_at = -1;
static uint32_t poke_address, poke_value;
static uint16_t hung_word;
static avr_flashaddr_t hung_at;
static void (*core_reset)(struct avr_t *avr);

static _Noreturn void fail(const char *what) {
	fprintf(stderr, "board: %s\n", what);
	exit(1);
}

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

/* ---- encoders ---- */

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

/* ---- motors ---- */

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

static int16_t duty(const motor_t *motor) {
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

/* ---- serial line ---- */

static void on_sent(struct avr_irq_t *irq, uint32_t value, void *param) {
	(void)irq, (void)param;
	if (from_count == sizeof from_board) fail("more bytes sent in a step than a reply holds: take shorter steps");
	from_board[from_count++] = value;
}

static avr_cycle_count_t on_byte_due(struct avr_t *of, avr_cycle_count_t when, void *param) {
	(void)of, (void)param;
	if (to_head == to_tail) return 0;
	avr_raise_irq(uart_in, to_board[to_tail++ % WAITING]);
	return when + BYTE_CYCLES;
}

/* simavr counts eleven bits to a byte; there are ten. */
static void pace(void) {
	for (avr_io_t *io = avr->io_port; io; io = io->next) {
		avr_uart_t *uart = (avr_uart_t *)io;
		if (strcmp(io->kind, "uart") || uart->name != '0') continue;
		int divider = word(uart->ubrrl.reg) + 1;
		uart->cycles_per_byte = 10 * divider * (avr_regbit_get(avr, uart->u2x) ? 8 : 16);
	}
}

static void receive(const uint8_t *bytes, uint16_t count) {
	if (to_head - to_tail + count > WAITING) fail("more bytes for the board are waiting than the line carries in 20 s");
	if (!avr_cycle_timer_status(avr, on_byte_due, NULL)) avr_cycle_timer_register(avr, BYTE_CYCLES, on_byte_due, NULL);
	for (uint16_t i = 0; i < count; i++) to_board[to_head++ % WAITING] = bytes[i];
}

/* ---- the chip ---- */

static void on_sleep(struct avr_t *of, avr_cycle_count_t cycles) {
	(void)of;
	asleep += cycles + 1;
}

static void on_interrupt(struct avr_irq_t *irq, uint32_t vector, void *param) {
	(void)irq, (void)param;
	if (vector) {
		interrupt_start = avr->cycle;
		return;
	}
	avr_cycle_count_t took = avr->cycle - interrupt_start;
	in_interrupts += took;
	if (took > longest_interrupt) longest_interrupt = took;
}

static void restore_hung(void) {
	if (!hung_word) return;
	memcpy(avr->flash + hung_at, &hung_word, 2);
	hung_word = 0;
}

/* What is outside of the chip does not change by its reset, but simavr has cleared its pins. */
static void on_reset(struct avr_t *of) {
	if (core_reset) core_reset(of);
	resets++;
	restore_hung();
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

static avr_cycle_count_t on_end(struct avr_t *of, avr_cycle_count_t when, void *param) {
	(void)of, (void)when, (void)param;
	return 0;
}

/* The loop hangs: the instruction that comes next in it is replaced by a jump to itself until the chip is reset. */
static void hang(void) {
	if (hang_at < 0 || avr->cycle < hang_at * MHZ * 1e6 || avr->interrupts.running_ptr) return;
	hang_at = -1;
	hung_at = avr->pc;
	memcpy(&hung_word, avr->flash + hung_at, 2);
	memcpy(avr->flash + hung_at, "\xFF\xCF", 2);
}

/* What only happens at a time: faults, and memory (u32) that is changed to be near a wrap. */
static void happen(void) {
	double now = avr->cycle / (MHZ * 1e6);
	if (unplug_at >= 0 && now >= unplug_at) inertial_plug(&inertial, false), unplug_at = -1;
	if (plug_at >= 0 && now >= plug_at) inertial_plug(&inertial, true), plug_at = -1;
	if (stick_at >= 0 && now >= stick_at) inertial.stuck = true, stick_at = -1;
	if (free_at >= 0 && now >= free_at) inertial.stuck = false, free_at = -1;
	if (poke_at >= 0 && now >= poke_at && !avr->interrupts.running_ptr)
		memcpy(avr->data + poke_address, &poke_value, 4), poke_at = -1;
}

static void run(const request_t *request) {
	step_start = avr->cycle;
	static avr_cycle_count_t due;
	due += (avr_cycle_count_t)request->step_us * MHZ;
	step_cycles = due > step_start ? due - step_start : 1;
	for (int side = 0; side < 2; side++) start_edges(&encoders[side], request->position[side]);
	avr_cycle_timer_register(avr, step_cycles, on_end, NULL);
	happen();
	pace();
	while (avr->cycle < due) {
		int state = avr_run(avr);
		if (state == cpu_Crashed || state == cpu_Done) fail("the firmware has crashed, or sleeps for ever");
		hang();
	}
	/* An instruction may reach beyond the end; no edge is left for later. */
	for (int side = 0; side < 2; side++) {
		avr_cycle_timer_cancel(avr, on_edge, &encoders[side]);
		while (encoders[side].done < (uint32_t)abs(encoders[side].ticks)) on_edge(avr, 0, &encoders[side]);
	}
}

static uint8_t hide(struct avr_t *of, avr_io_addr_t address, void *param) {
	(void)of, (void)address, (void)param;
	return 0;
}

static void be_quiet(avr_t *of, const int level, const char *format, va_list arguments) {
	(void)of;
	if (level == LOG_ERROR) vfprintf(stderr, format, arguments);
}

static void begin(const char *path) {
	elf_firmware_t firmware = {0};
	avr_global_logger_set(be_quiet);
	if (elf_read_firmware(path, &firmware)) fail("the firmware cannot be read");
	avr = avr_make_mcu_by_name("atmega2560");
	avr_init(avr);
	firmware.frequency = MHZ * 1000000;
	firmware.vcc = firmware.avcc = firmware.aref = BATTERY_REFERENCE_MV;
	avr_load_firmware(avr, &firmware);
	avr->sleep = on_sleep;
	core_reset = avr->reset;
	avr->reset = on_reset;

	uint32_t flags = 0;
	avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
	uart_in = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
	avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), on_sent, NULL);
	avr_irq_register_notify(avr_get_interrupt_irq(avr, AVR_INT_ANY) + AVR_INT_IRQ_RUNNING, on_interrupt, NULL);
	if (boot_loader) avr_register_io_read(avr, 0x54, hide, NULL); /* MCUSR */
	inertial_begin(&inertial, avr);
	freeze_pwm_timers();
	for (int side = 0; side < 2; side++) {
		encoder_t *encoder = &encoders[side];
		encoder->irq[0] = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(port_of(encoder->a)), bit_of(encoder->a));
		encoder->irq[1] = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(port_of(encoder->b)), bit_of(encoder->b));
		set_pins(encoder);
	}
}

static void take_options(int count, char **words) {
	static const struct option OPTIONS[] = {
		{"imu", 1, 0, 'i'},		{"imu-axes", 1, 0, 'a'}, {"unplug-at", 1, 0, 'u'}, {"plug-at", 1, 0, 'p'},
		{"stick-at", 1, 0, 's'}, {"free-at", 1, 0, 'f'}, {"hang-at", 1, 0, 'h'}, {"poke", 1, 0, 'k'},
		{"boot-loader", 0, 0, 'b'}, {0, 0, 0, 0}};
	for (int option; (option = getopt_long(count, words, "", OPTIONS, NULL)) >= 0;) {
		int axes[3];
		switch (option) {
			case 'i':
				inertial.kind = !strcmp(optarg, "none") ? INERTIAL_NONE
								: !strcmp(optarg, "mpu6500") ? INERTIAL_MPU6500 : INERTIAL_MPU9250;
				break;
			case 'a':
				if (sscanf(optarg, "%d,%d,%d", &axes[0], &axes[1], &axes[2]) != 3) fail("--imu-axes wants 1,2,3");
				for (int i = 0; i < 3; i++) inertial.axes[i] = axes[i];
				break;
			case 'u': unplug_at = atof(optarg); break;
			case 'p': plug_at = atof(optarg); break;
			case 's': stick_at = atof(optarg); break;
			case 'f': free_at = atof(optarg); break;
			case 'h': hang_at = atof(optarg); break;
			case 'b': boot_loader = true; break;
			case 'k':
				if (sscanf(optarg, "%lf,%" SCNu32 ",%" SCNu32, &poke_at, &poke_address, &poke_value) != 3 ||
					poke_address > 0x21FC)
					fail("--poke wants SECONDS,ADDRESS,VALUE");
				break;
			default: exit(2);
		}
	}
	if (optind != count - 1)
		fail("usage: board [--imu mpu9250|mpu6500|none] [--imu-axes 1,2,3] [--unplug-at S] [--plug-at S] [--stick-at S] "
			 "[--free-at S] [--hang-at S] [--poke S,ADDRESS,VALUE] [--boot-loader] FIRMWARE");
}

int main(int count, char **words) {
	take_options(count, words);
	begin(words[optind]);
	avr_irq_t *battery = avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC0 + BATTERY_PIN);
	static uint8_t bytes[65535];
	request_t request;
	while (fread(&request, sizeof request, 1, stdin) == 1) {
		if (fread(bytes, 1, request.bytes, stdin) != request.bytes) fail("a request was cut short");
		memcpy(inertial.values, request.imu, sizeof request.imu);
		avr_raise_irq(battery, (uint32_t)(request.battery_mv / BATTERY_DIVIDER + 0.5f));
		if (request.bytes) receive(bytes, request.bytes);
		from_count = 0;
		run(&request);
		reply_t reply = {avr->cycle, {duty(&MOTORS[0]), duty(&MOTORS[1])}, from_count};
		fwrite(&reply, sizeof reply, 1, stdout);
		fwrite(from_board, 1, from_count, stdout);
		fflush(stdout);
	}
	fprintf(stderr, "{\"cycles\": %" PRIu64 ", \"asleep\": %" PRIu64 ", \"in_interrupts\": %" PRIu64
					", \"longest_interrupt\": %" PRIu64 ", \"resets\": %u}\n",
			avr->cycle, asleep, in_interrupts, longest_interrupt, resets);
	return 0;
}
