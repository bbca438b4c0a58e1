#pragma once

namespace hexcal {

/// Lets all that the process prints pass through printable_lines, so that no name of a file or text of a
/// camera can command the terminal; hexcal's own colours and progress bars, behind kOwnSequence, stay on a
/// terminal. To be called once, before anything is printed.
void make_output_printable();

/// Says nothing more on the standard output.
void silence_output();

/// Writes out what is left; the system's error number of the first write that failed, or 0.
[[nodiscard]] int output_error();

/// Stands before every escape sequence and carriage return of hexcal's own.
inline constexpr char kOwnSequence = '\x0E';

}  // namespace hexcal
