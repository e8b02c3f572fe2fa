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
#include "fail.h"
#include "inertial.h"
#include "line.h"
#include "sim_avr.h"
#include "sim_elf.h"
#include "sim_interrupts.h"
#include "wheels.h"

enum { MHZ = 16 };

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

static avr_t *avr;
static inertial_t inertial = {.kind = INERTIAL_MPU9250, .axes = {IMU_AHEAD, IMU_LEFT, IMU_UP}};

static avr_cycle_count_t asleep, in_interrupts, interrupt_start, longest_interrupt;
static unsigned resets;
static bool boot_loader; /* there is one, which hides why the chip was reset */
static double hang_at = -1, unplug_at = -1, plug_at = -1, stick_at = -1, free_at = -1, poke_at = -1;
static uint32_t poke_address, poke_value;
static uint16_t hung_word;
static avr_flashaddr_t hung_at;
static void (*core_reset)(struct avr_t *avr);

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

static void on_reset(struct avr_t *of) {
	if (core_reset) core_reset(of);
	resets++;
	restore_hung();
	wheels_restore();
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
	if (stick_at >= 0 && now >= stick_at) inertial.stuck = true, inertial.stubborn = free_at >= 0, stick_at = -1;
	if (free_at >= 0 && now >= free_at) inertial.stuck = false, free_at = -1;
	if (poke_at >= 0 && now >= poke_at && !avr->interrupts.running_ptr)
		memcpy(avr->data + poke_address, &poke_value, 4), poke_at = -1;
}

static void run(const request_t *request) {
	static avr_cycle_count_t due;
	due += (avr_cycle_count_t)request->step_us * MHZ;
	avr_cycle_count_t cycles = due > avr->cycle ? due - avr->cycle : 1;
	int32_t positions[2];
	memcpy(positions, request->position, sizeof positions);
	wheels_turn(positions, cycles);
	avr_cycle_timer_register(avr, cycles, on_end, NULL);
	happen();
	line_step();
	while (avr->cycle < due) {
		int state = avr_run(avr);
		if (state == cpu_Crashed || state == cpu_Done) fail("the firmware has crashed, or sleeps for ever");
		hang();
	}
	wheels_arrive();
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

	avr_irq_register_notify(avr_get_interrupt_irq(avr, AVR_INT_ANY) + AVR_INT_IRQ_RUNNING, on_interrupt, NULL);
	if (boot_loader) avr_register_io_read(avr, 0x54, hide, NULL); /* MCUSR */
	inertial_begin(&inertial, avr);
	wheels_begin(avr);
	line_begin(avr);
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
		if (request.bytes) line_receive(bytes, request.bytes);
		run(&request);
		const uint8_t *sent;
		reply_t reply = {avr->cycle, {wheels_duty(0), wheels_duty(1)}, line_sent(&sent)};
		fwrite(&reply, sizeof reply, 1, stdout);
		fwrite(sent, 1, reply.bytes, stdout);
		fflush(stdout);
	}
	fprintf(stderr, "{\"cycles\": %" PRIu64 ", \"asleep\": %" PRIu64 ", \"in_interrupts\": %" PRIu64
					", \"longest_interrupt\": %" PRIu64 ", \"resets\": %u}\n",
			avr->cycle, asleep, in_interrupts, longest_interrupt, resets);
	return 0;
}
