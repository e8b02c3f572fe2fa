/* UART0 of the simulated Mega and the line on it, at its real pace. */
#pragma once
#include <stdint.h>

#include "sim_avr.h"

void line_begin(avr_t *avr);

/* Before time passes: a new step, in which nothing has been sent yet. */
void line_step(void);

/* Bytes for the board; they wait for their turn on the line. */
void line_receive(const uint8_t *bytes, uint16_t count);

/* What UART0 has sent in this step; how many bytes. */
uint16_t line_sent(const uint8_t **bytes);
