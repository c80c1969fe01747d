#include "app/verbs/message_echo.h"

#include <algorithm>
#include <array>
#include <map>

#include "app/number_checks.h"

namespace doppel::app {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kSearchPeriod =
    std::chrono::milliseconds(200);  // between looks for topics that do not exist yet

// In the order of service_msgs/msg/ServiceEventInfo's constants.
constexpr std::array kEventNames = {"REQUEST_SENT", "REQUEST_RECEIVED", "RESPONSE_SENT", "RESPONSE_RECEIVED"};

// The kind of an event in its YAML by name, as ros2 service echo prints it.
std::string with_event_name(std::string yaml) {
  constexpr std::string_view kField = "event_type: ";
  const std::size_t found = yaml.find(kField);
  if (found == std::string::npos) return yaml;
  const std::size_t digit = found + kField.size();
  const std::size_t kind =
      digit < yaml.size() ? static_cast<std::size_t>(yaml[digit] - '0') : kEventNames.size();
  if (kind < kEventNames.size()) yaml.replace(digit, 1, kEventNames[kind]);
  return yaml;
}

class Echo {
 public:
  Echo(Client& twin, const std::vector<EchoSource>& sources, const EchoAllOptions& options)
      : twin_(twin), options_(options) {
    for (const EchoSource& source : sources) sources_.emplace(source.topic, Followed{source, nullptr});
  }

  void run() {
    subscribe_to_present();
    note_missing();
    std::size_t left = options_.count;
    while (true) {
      Client::Received message;
      if (twin_.next(message,
                     Clock::now() + (missing().empty() ? Clock::duration(kForever) : kSearchPeriod)) &&
          print(message) && left > 0 && --left == 0)
        return;
      subscribe_to_present();
    }
  }

 private:
  struct Followed {
    EchoSource source;
    const TypeSupport* type;  // nullptr: there is no such topic yet
  };

  [[nodiscard]] std::vector<std::string> missing() const {
    std::vector<std::string> names;
    for (const auto& [topic, followed] : sources_) {
      if (followed.type == nullptr) names.push_back(topic);
    }
    return names;
  }

  void subscribe_to_present() {
    for (const std::string& topic : missing()) {
      Followed& followed = sources_.at(topic);
      const auto found = twin_.topics().find(topic);
      const bool is_published = found != twin_.topics().end() && !found->second.publishers.empty();
      if (!is_published && followed.source.is_event) continue;
      followed.type = &twin_.message_type(topic);
      twin_.subscribe(topic);
    }
  }

  void note_missing() const {
    const std::vector<std::string> names = missing();
    if (names.empty()) return;
    print_note(fmt::format(
        "{} {} not published yet. A twin publishes the events of its services after: doppel param "
        "set /gazebo service_introspection contents",
        fmt::join(names, ", "), names.size() == 1 ? "is" : "are"));
  }

  bool print(const Client::Received& message) const {
    const auto found = sources_.find(message.topic);
    if (found == sources_.end() || found->second.type == nullptr) return false;
    const auto& [source, type] = found->second;
    check_same_type(*type, message);
    std::string text = echo_text(*type, message.cdr, options_.format);
    if (source.is_event && !options_.format.csv) text = with_event_name(std::move(text));
    print_out((source.interface.empty() ? "" : "interface: " + source.interface + "\n") + text);
    return true;
  }

  Client& twin_;
  const EchoAllOptions& options_;
  std::map<std::string, Followed> sources_;
};

}  // namespace

void add_format_options(CLI::App& verb, MessageFormat& format) {
  CLI::Option* const csv =
      verb.add_flag("--csv", format.csv, "Print values only, separated by commas, one line each");
  verb.add_flag("--flow-style", format.flow, "Print each message as one line of YAML")->excludes(csv);
  verb.add_flag("--no-arr", format.no_arrays, "Print the type and length of lists instead of them");
  verb.add_flag("--no-str", format.no_strings, "Print the length of texts instead of them");
}

void add_echo_options(CLI::App& verb, EchoAllOptions& options) {
  verb.add_option("-n,--count", options.count, "Print this many messages and exit")->check(positive_number());
  add_format_options(verb, options.format);
}

std::string echo_text(const TypeSupport& type, std::span<const std::byte> cdr, const MessageFormat& format) {
  // YAML in block style of whole messages, in which texts are quoted where necessary.
  const bool is_plain =
      format.field.empty() && !format.csv && !format.flow && !format.no_arrays && !format.no_strings;
  std::string text;
  const Status status =
      is_plain ? type.cdr_to_yaml(cdr, text) : format_message(*type.description(), cdr, format, text);
  if (!status) throw ClientError(status.why());
  return format.csv ? text : text + "---\n";
}

void check_same_type(const TypeSupport& type, const Client::Received& message) {
  if (message.type == type.name) return;
  throw ClientError(
      fmt::format("{} is {} now, not {}; start this again", message.topic, message.type, type.name));
}

int echo_all(Shell& shell, const std::vector<EchoSource>& sources, const EchoAllOptions& options) {
  Shell::catch_interrupts();
  try {
    Echo(shell.twin(), sources, options).run();
  } catch (const Interrupted&) {  // Ctrl-C is the normal end
  }
  return 0;
}

}  // namespace doppel::app
