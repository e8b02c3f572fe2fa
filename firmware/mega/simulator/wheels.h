/* Motor driver and encoders on the pins of the simulated Mega, wired as config.h says. */
#pragma once
#include <stdint.h>

#include "sim_avr.h"

void wheels_begin(avr_t *avr);

/* simavr has cleared the pins in a reset of the chip; what is outside does not change. */
void wheels_restore(void);

/* From now on, for some cycles, turn the wheels to these positions (ticks); edges are spread evenly. */
void wheels_turn(const int32_t *positions, avr_cycle_count_t cycles);

/* At the end of these cycles: an edge that an instruction has delayed beyond them comes now. */
void wheels_arrive(void);

/* What the driver gives a motor (0 left, 1 right), per mille, from PWM and direction pins. */
int16_t wheels_duty(int side);
