// The base: what it was told, its wheels, what it tells.
#pragma once
#include <Arduino.h>

#include "ticker.h"

namespace base {

void begin();

// Obey a body whose CRC was right, if the rest is.
void obey(const uint8_t *body, uint8_t length);

// Control the wheels, once a period; every fourth time tell the host.
void step(const ticker::Sample &sample);

}  // namespace base
