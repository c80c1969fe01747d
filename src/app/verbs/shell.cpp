#include "app/verbs/shell.h"

#include <algorithm>
#include <atomic>
#include <charconv>
#include <csignal>
#include <cstdio>

#include "app/tell.h"
#include "doppel/core/names.h"
#include "doppel/server/announcement.h"
#include "doppel/server/websocket_client.h"

namespace doppel::app {
namespace {

constexpr int kInterruptedExit = 130;  // 128 + SIGINT, as shells count

std::atomic<bool> interrupt_caught = false;

std::uint16_t parse_port(const char* text) {
  const std::string_view view(text);
  std::uint16_t port = 0;
  const auto [end, problem] = std::from_chars(view.data(), view.data() + view.size(), port);
  if (problem != std::errc() || end != view.data() + view.size() || port == 0) {
    wrong_use(fmt::format("DOPPEL_PORT is '{}', which is no port", text),
              "unset it, or give a number from 1 to 65535");
  }
  return port;
}

// With an announcement also the token, if the twin asks for one.
RunningTwin twin_at(std::uint16_t port) {
  for (const RunningTwin& twin : find_running()) {
    if (twin.port == port) return twin;
  }
  RunningTwin unannounced;
  unannounced.port = port;
  return unannounced;
}

RunningTwin choose_twin(int port) {
  if (port != 0) return twin_at(static_cast<std::uint16_t>(port));
  if (const char* chosen = std::getenv("DOPPEL_PORT"); chosen != nullptr && *chosen != '\0')
    return twin_at(parse_port(chosen));
  const std::vector<RunningTwin> twins = find_running();
  if (twins.empty()) throw ClientError("no twin is running; start one with: doppel up omarm_one");
  if (twins.size() > 1) {
    std::string others;
    for (const RunningTwin& twin : twins) others += fmt::format(" {} (--port {})", twin.robot, twin.port);
    print_note(fmt::format("note: {} twins are running:{}; taking the newest", twins.size(), others));
  }
  return twins.front();
}

}  // namespace

void print_out(std::string_view text) {
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0)
    throw OutputClosed();
}

void print_note(std::string_view text) {
  tell("{}\n", text);
}

void wrong_use(std::string message, std::string mend) {
  throw InputError("cli.use", {}, std::move(message), std::move(mend));
}

Client& Shell::twin() {
  if (client_ == nullptr) {
    ClientOptions options;
    const RunningTwin chosen = choose_twin(port_);
    options.host = chosen.address;
    options.port = chosen.port;
    options.token = chosen.token;
    options.interrupted = interrupted;
    options.on_status = [](const std::string& text) { print_note("warning: " + text); };
    client_ = std::make_unique<WebSocketClient>(std::move(options));
  }
  return *client_;
}

void Shell::catch_interrupts() {
  struct sigaction action {};
  action.sa_handler = [](int) { interrupt_caught = true; };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool Shell::interrupted() {
  return interrupt_caught;
}
void Shell::clear_interrupt() {
  interrupt_caught = false;
}

int run_verb(int port, const std::function<int(Shell&)>& run) {
  Shell shell(port);
  try {
    return run(shell);
  } catch (const Interrupted&) {
    return kInterruptedExit;
  } catch (const OutputClosed&) {
    return 0;
  }
}

CLI::App& add_group(CLI::App& app, const std::string& name, const std::string& help) {
  CLI::App* group = app.add_subcommand(name, help);
  group->require_subcommand(1);
  return *group;
}

std::string absolute(std::string_view name) {
  return name.starts_with('/') ? std::string(name) : fmt::format("/{}", name);
}

bool is_hidden(std::string_view name) {
  return name.find("/_") != std::string_view::npos;
}

const TypeSupport& known_type(const std::string& name) {
  if (const TypeSupport* type = find_type(name)) return *type;
  wrong_use(fmt::format("'{}' is no known message type{}", name, did_you_mean(name, type_names())),
            "'doppel interface list' shows all");
}

std::vector<std::string> node_names(Client& twin, bool hidden) {
  std::vector<std::string> names = twin.nodes();
  if (!hidden) std::erase_if(names, is_hidden);
  return names;
}

std::string find_node_name(Client& twin, const std::string& name) {
  const std::string full = absolute(name);
  const std::vector<std::string> names = node_names(twin, true);
  if (std::ranges::find(names, full) != names.end()) return full;
  throw ClientError(fmt::format("there is no node {}{}", full, did_you_mean(full, names)));
}

Bytes to_request(const TypeSupport& type, std::string_view yaml) {
  Bytes cdr;
  if (const Status status = type.yaml_to_cdr(yaml, cdr); !status) {
    wrong_use(fmt::format("the text is no {}: {}", type.name, status.why()),
              fmt::format("'doppel interface show {}' lists its fields", type.name));
  }
  return cdr;
}

Bytes call_raw(Client& twin, const std::string& service, std::span<const std::byte> request,
               std::chrono::milliseconds at_most) {
  Client::Answer answer = twin.call(service, request, at_most);
  if (!answer.ok) throw ClientError(answer.why);
  return std::move(answer.response);
}

}  // namespace doppel::app
