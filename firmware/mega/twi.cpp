#include "twi.h"

#include <util/twi.h>

namespace twi {
namespace {

volatile Status state;
uint8_t address, reg, value, count;
bool reading;
volatile uint8_t at;
uint8_t buffer[MOST];

constexpr uint8_t GO = _BV(TWINT) | _BV(TWEN) | _BV(TWIE);

void start() {
  at = 0;
  state = BUSY;
  TWCR = GO | _BV(TWSTA);
}

void end(Status how) {
  TWCR = _BV(TWINT) | _BV(TWEN) | _BV(TWSTO);
  state = how;
}

}  // namespace

void begin() {
  pinMode(SDA, INPUT_PULLUP);
  pinMode(SCL, INPUT_PULLUP);
  TWSR = 0;
  TWBR = 12;  // 400 kHz
  TWCR = _BV(TWEN);
}

void write(uint8_t to, uint8_t to_reg, uint8_t what) {
  address = to;
  reg = to_reg;
  value = what;
  reading = false;
  start();
}

void read(uint8_t from, uint8_t from_reg, uint8_t bytes) {
  address = from;
  reg = from_reg;
  count = bytes;
  reading = true;
  start();
}

Status status() { return state; }

void give_up() {
  // A part that was cut off in the midst of a byte may hold the data line: clock it out.
  TWCR = 0;
  for (uint8_t i = 0; i < 9; i++) {
    digitalWrite(SCL, LOW);  // the pull-up of before would make it an output that is high
    pinMode(SCL, OUTPUT);
    delayMicroseconds(5);
    pinMode(SCL, INPUT_PULLUP);
    delayMicroseconds(5);
  }
  begin();
  state = FAILED;
}

const uint8_t *data() { return buffer; }

}  // namespace twi

ISR(TWI_vect) {
  using namespace twi;
  switch (TW_STATUS) {
    case TW_START:
      TWDR = address << 1 | TW_WRITE;
      TWCR = GO;
      break;
    case TW_MT_SLA_ACK:
      TWDR = reg;
      TWCR = GO;
      break;
    case TW_MT_DATA_ACK:
      if (reading) {
        TWCR = GO | _BV(TWSTA);
      } else if (at == 0) {
        at = 1;
        TWDR = value;
        TWCR = GO;
      } else {
        end(DONE);
      }
      break;
    case TW_REP_START:
      TWDR = address << 1 | TW_READ;
      TWCR = GO;
      break;
    case TW_MR_SLA_ACK:
      TWCR = count > 1 ? GO | _BV(TWEA) : GO;
      break;
    case TW_MR_DATA_ACK: {
      uint8_t next = at;
      buffer[next++] = TWDR;
      at = next;
      TWCR = next + 1 < count ? GO | _BV(TWEA) : GO;  // the last byte is not acknowledged
      break;
    }
    case TW_MR_DATA_NACK:
      buffer[at] = TWDR;
      end(DONE);
      break;
    default:  // nobody there, or the bus is disturbed
      end(FAILED);
  }
}
