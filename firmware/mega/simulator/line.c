#include "line.h"

#include <stddef.h>
#include <string.h>

#include "avr_uart.h"
#include "fail.h"

enum { BYTE_CYCLES = 16 * 10 * 1000000 / 115200, WAITING = 1 << 18 };

static avr_t *avr;
static avr_irq_t *uart_in;
static uint8_t to_board[WAITING], from_board[65535];
static uint32_t to_head, to_tail, from_count;

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

void line_step(void) {
	from_count = 0;
	/* simavr counts eleven bits to a byte; there are ten. */
	for (avr_io_t *io = avr->io_port; io; io = io->next) {
		avr_uart_t *uart = (avr_uart_t *)io;
		if (strcmp(io->kind, "uart") || uart->name != '0') continue;
		int divider = (avr->data[uart->ubrrl.reg] | avr->data[uart->ubrrh.reg] << 8) + 1;
		uart->cycles_per_byte = 10 * divider * (avr_regbit_get(avr, uart->u2x) ? 8 : 16);
	}
}

void line_receive(const uint8_t *bytes, uint16_t count) {
	if (to_head - to_tail + count > WAITING) fail("more bytes for the board are waiting than the line carries in 20 s");
	if (!avr_cycle_timer_status(avr, on_byte_due, NULL)) avr_cycle_timer_register(avr, BYTE_CYCLES, on_byte_due, NULL);
	for (uint16_t i = 0; i < count; i++) to_board[to_head++ % WAITING] = bytes[i];
}

uint16_t line_sent(const uint8_t **bytes) {
	*bytes = from_board;
	return from_count;
}

void line_begin(avr_t *of) {
	avr = of;
	uint32_t flags = 0;
	avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
	uart_in = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
	avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), on_sent, NULL);
}
