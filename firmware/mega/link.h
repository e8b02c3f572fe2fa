// The serial line: bytes by interrupt, frames to the rest.
#pragma once
#include <Arduino.h>

namespace link {

void begin();

// The next good frame's body, and its length; 0 if there is none yet. Holds until the next call.
uint8_t receive(uint8_t *&body);
bool waiting();

// Send a body with room for the CRC-32 at its end; the sequence is put in here. A body that may be left out is, if the
// line is so full that one which may not would have to wait. False if it was left out.
bool send(uint8_t *body, uint8_t length, bool may_be_left_out);

// A frame was refused, or a byte lost or garbled, since the last call.
bool refused();
void refuse();

}  // namespace link
