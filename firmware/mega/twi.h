// The I2C bus by interrupt: a transfer runs while the loop goes on.
#pragma once
#include <Arduino.h>

namespace twi {

enum Status : uint8_t { IDLE, BUSY, DONE, FAILED };

void begin();

// Start to write a register, or to read some from one on; only while not busy.
void write(uint8_t address, uint8_t reg, uint8_t value);
void read(uint8_t address, uint8_t reg, uint8_t count);

Status status();  // of the last transfer
// Let a transfer be that takes too long, and free the bus.
void give_up();
const uint8_t *data();

constexpr uint8_t MOST = 16;  // bytes of a transfer

}  // namespace twi
