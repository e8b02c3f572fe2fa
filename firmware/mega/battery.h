// Voltage of the battery, by the converter, without waiting for it.
#pragma once
#include <Arduino.h>

namespace battery {

void begin();
// Once a period.
void tick();
uint16_t millivolts();  // 0 where none is wired
bool low();

}  // namespace battery
