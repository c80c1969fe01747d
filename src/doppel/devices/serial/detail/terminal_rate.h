#pragma once
// Bit rates of terminals, also those that have no constant of their own. In a file of its own, because the
// kernel's header with them and the C library's exclude each other.

namespace doppel {

// Sets a raw terminal of 8 bits without parity and flow control, without hang-up on close. 0, or errno.
int set_raw_terminal(int file, int bits_per_second);
// The output rate, bit/s; 0: unknown.
int terminal_rate(int file);

// Output that was stopped (TCOOFF) continues.
void start_output(int file);

// Forgets bytes that have been received and not read; `sent`: also those that are not sent yet. False: the
// file is no terminal.
bool flush_terminal(int file, bool sent);

}  // namespace doppel
