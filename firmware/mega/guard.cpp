#include "guard.h"

#include <avr/wdt.h>

#include "config.h"
#include "motors.h"

namespace guard {
namespace {

// Not cleared at a start. Boot loaders hide the chip's own note of a watchdog reset; this one they leave alone.
constexpr uint32_t HUNG = 0x484E4721;
uint32_t note __attribute__((section(".noinit")));
uint8_t cause __attribute__((section(".noinit")));

}  // namespace

// Before main: after a watchdog reset the watchdog goes on, at its shortest time.
void early() __attribute__((naked, used, section(".init3")));
void early() {
  cause = MCUSR & 15;
  MCUSR = 0;
  wdt_disable();
}

void begin() {
  if (cause & _BV(PORF)) cause = _BV(PORF);  // what else is set then means nothing
  else if (note == HUNG) cause |= _BV(WDRF);
  note = 0;
  if (!HARDWARE_WATCHDOG) return;
  wdt_enable(WDTO_120MS);
  WDTCSR |= _BV(WDIE);  // the interrupt first, and the reset at the next 120 ms
}

void alive() {
  wdt_reset();
}

uint8_t reset_cause() { return cause; }

}  // namespace guard

ISR(WDT_vect) {
  motors::off();
  guard::note = guard::HUNG;
  for (;;) {
  }
}
