#pragma once
// Messages as `topic echo`, `service echo` and `action echo` print them.

#include <string>
#include <vector>

#include "app/verbs/field_value.h"
#include "app/verbs/shell.h"

namespace doppel::app {

// --csv, --flow-style, --no-arr and --no-str.
void add_format_options(CLI::App& verb, MessageFormat& format);

// The message in this format, with the line "---" behind it unless it is CSV. Throws ClientError.
std::string echo_text(const TypeSupport& type, std::span<const std::byte> cdr, const MessageFormat& format);

// Throws ClientError if the topic has got another type since it was subscribed to.
void check_same_type(const TypeSupport& type, const Client::Received& message);

// A topic whose messages are printed by echo_all().
struct EchoSource {
  std::string topic;
  std::string interface;  // "GOAL_SERVICE": a line above each message; empty: none
  bool is_event = false;  // of a service's calls: its kind is printed by name, and the topic may appear later
};
struct EchoAllOptions {
  MessageFormat format;
  std::size_t count = 0;  // 0: until Ctrl-C
};
// -n and those of the format.
void add_echo_options(CLI::App& verb, EchoAllOptions& options);
// Prints the messages of all of these topics as they arrive. Topics of events that do not exist are noted
// with what has them published, and awaited. Returns the exit code.
int echo_all(Shell& shell, const std::vector<EchoSource>& sources, const EchoAllOptions& options);

}  // namespace doppel::app
