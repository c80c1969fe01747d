// doppel hardware: the way from a box of servos to a first motion.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>

#include "app/description_target.h"
#include "app/output.h"
#include "app/print_stderr.h"
#include "app/verbs/hardware_target.h"
#include "app/verbs/shell.h"
#include "app/verbs/verbs.h"
#include "doppel/base/core/names.h"
#include "doppel/base/core/text.h"
#include "doppel/base/yaml/yaml_text.h"
#include "doppel/devices/commissioning/bus_check.h"
#include "doppel/devices/commissioning/bus_scan.h"
#include "doppel/devices/commissioning/nudge.h"
#include "doppel/devices/commissioning/pose_confirmation.h"
#include "doppel/devices/commissioning/recovery.h"
#include "doppel/devices/drivers/check_record.h"
#include "doppel/devices/drivers/servo_hardware.h"
#include "doppel/devices/serial/file_link.h"
#include "doppel/devices/serial/serial_ports.h"
#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/ros/server/announcement.h"

namespace doppel::app {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kDegree = std::numbers::pi / 180;

// -- scan

struct ScanVerbOptions {
  std::vector<std::string> ports;
  std::string protocol;
  int rate = 0, last_id = 252;
  bool json = false;
};

// The protocol of a name; all of them, where it is empty.
std::vector<ServoProtocol> protocols_named(const std::string& name) {
  const std::vector<ServoProtocol> all = ScanOptions{}.protocols;
  if (name.empty()) return all;
  std::vector<std::string> names;
  for (const ServoProtocol one : all) {
    if (to_string(one) == name) return {one};
    names.emplace_back(to_string(one));
  }
  throw_usage_error(fmt::format("there is no protocol '{}'{}", name, did_you_mean(name, names)));
}

ScanOptions scan_options(const ScanVerbOptions& options) {
  ScanOptions out;
  out.protocols = protocols_named(options.protocol);
  if (options.rate > 0) out.rates = {options.rate};
  out.last_id = options.last_id;
  const bool shown = isatty(STDERR_FILENO) != 0;
  out.progress = [shown](double done, const std::string& trying) {
    if (shown) print_stderr("\r\033[K{:3.0f} %  {}", 100 * done, trying);
    return true;
  };
  return out;
}

std::string number_text(double value, const char* unit, int digits = 1) {
  return std::isfinite(value) ? fmt::format("{:.{}f} {}", value, digits, unit) : "-";
}

void print_device(const FoundDevice& one) {
  if (!one.board.empty()) return print_line("    {}\n", one.board);
  const std::string model = one.model != nullptr ? std::string(one.model->name)
                                                 : fmt::format("model {}, not known", one.answer.number);
  print_line("    id {:3}  {:<12} {:>7} {:>8} {:>10}{}\n", one.answer.id, model,
             number_text(one.reading.voltage, "V"), number_text(one.reading.temperature, "C", 0),
             number_text(one.reading.position / kDegree, "deg"),
             one.answer.answers > 1
                 ? "   several servos have this id: connect them one by one, then doppel hardware set-id"
                 : "");
}

Json json_of(const FoundDevice& one) {
  const auto number = [](double value) { return std::isfinite(value) ? Json(value) : Json(); };
  return {{"protocol", to_string(one.protocol)},
          {"rate", one.rate},
          {"id", one.answer.id},
          {"model", one.model != nullptr ? Json(one.model->name) : Json()},
          {"model_number", one.answer.number},
          {"board", one.board.empty() ? Json() : Json(one.board)},
          {"shared_id", one.answer.answers > 1},
          {"position", number(one.reading.position)},
          {"voltage", number(one.reading.voltage)},
          {"temperature", number(one.reading.temperature)}};
}

int run_scan(const ScanVerbOptions& options) {
  std::vector<PortInfo> ports;
  for (const std::string& path : options.ports) ports.emplace_back().path = path;
  if (ports.empty()) {
    ports = serial_ports();
    std::ranges::move(emulated_ports(), std::back_inserter(ports));
  }
  const ScanOptions scan = scan_options(options);
  Json all = Json::array();
  std::size_t found = 0;
  for (const PortInfo& port : ports) {
    Json one{
        {"port", port.path}, {"by_id", port.by_id}, {"product", port.product}, {"devices", Json::array()}};
    if (!options.json)
      print_line("{}{}{}\n", port.path, port.product.empty() ? "" : "  " + port.product,
                 port.by_id.empty() ? "" : "\n    " + port.by_id);
    try {
      const auto link = open_link(port.path, kDefaultRate);
      const std::vector<FoundDevice> devices = scan_link(*link, scan);
      if (isatty(STDERR_FILENO) != 0) print_stderr("\r\033[K");
      found += devices.size();
      for (const FoundDevice& device : devices) one["devices"].push_back(json_of(device));
      if (!options.json && devices.empty()) print_line("    nothing answers\n");
      if (!options.json && !devices.empty())
        print_line("    {} at {} bit/s\n", to_string(devices.front().protocol), devices.front().rate);
      if (!options.json) std::ranges::for_each(devices, print_device);
    } catch (const InputError& problem) {
      const Diagnostic& why = problem.diagnostics().front();
      one["error"] = why.message;
      if (!options.json) print_line("    {}\n    fix: {}\n", why.message, why.fix);
    }
    if (!options.json && port.latency_timer.value_or(0) > kMaxLatencyTimer)
      print_line(
          "    its latency timer is {} ms, which limits a bus to about {} Hz\n    fix: echo 1 | sudo tee "
          "/sys/class/tty/{}/device/latency_timer\n",
          *port.latency_timer, 1000 / *port.latency_timer, port.path.substr(port.path.rfind('/') + 1));
    all.push_back(std::move(one));
  }
  if (options.json) deliver(all.dump(2) + "\n");
  if (!options.json && ports.empty())
    print_note("no serial port is connected; an arm that is not there: doppel emulate TARGET");
  return found > 0 ? 0 : 1;
}

// -- check

struct CheckVerbOptions {
  HardwareOptions hardware;
  bool fix = false, yes = false;
  std::string backup;
};

void print_changes(const std::vector<RegisterChange>& changes) {
  for (const RegisterChange& one : changes)
    print_line("  '{}' (id {}): {} {} -> {}, {}\n", one.joint, one.id, one.which->name, one.before, one.after,
               one.why);
}

// The driver moves at full speed once the check has passed, and each joint was nudged.
void record_check(const OpenBus& open) {
  const auto file = check_record_file(open.setup.component, open.link->name());
  CheckRecord record = read_check_record(file);
  record.checked = fingerprint(open.setup);
  write_check_record(file, record);
  const std::vector<std::string> missing = unconfirmed_joints(record, open.setup);
  if (!missing.empty())
    print_line("to be confirmed by a nudge, before the arm moves at full speed: {}\n",
               fmt::join(missing, ", "));
}

int run_bus_check(const CheckVerbOptions& options) {
  OpenBus open = open_bus(options.hardware);
  const BusCheck check = check_bus(*open.bus, open.setup);
  for (const Diagnostic& one : check.findings) print_note(one.str());
  if (check.changes.empty()) {
    print_line("{} servos on {}: {}\n", open.setup.joints.size(), open.link->name(),
               check.passed() ? "as the description needs them" : "see above");
    if (check.passed()) record_check(open);
    return check.passed() ? 0 : 1;
  }
  print_line("registers that should have other values:\n");
  print_changes(check.changes);
  if (!options.fix) {
    print_line("doppel hardware check --fix writes them\n");
    return 1;
  }
  if (!confirmed("write them into the servos' memory?", options.yes)) return 1;
  const std::string backup =
      options.backup.empty() ? fmt::format("{}_registers.yaml", open.setup.component) : options.backup;
  apply_changes(*open.bus, open.setup, check.changes, backup);
  print_line("written; the former values are in {}\n", backup);
  if (!check_bus(*open.bus, open.setup).passed()) return 1;
  record_check(open);
  return 0;
}

struct RestoreVerbOptions {
  HardwareOptions hardware;
  std::string file;
  bool yes = false;
};

int run_restore(const RestoreVerbOptions& options) {
  OpenBus open = open_bus(options.hardware);
  const std::vector<RegisterChange> changes = changes_back(*open.bus, open.setup, options.file);
  if (changes.empty()) {
    print_line("the servos have these values\n");
    return 0;
  }
  print_changes(changes);
  if (!confirmed("write them into the servos' memory?", options.yes)) return 1;
  apply_changes(*open.bus, open.setup, changes, options.file + ".before");
  return 0;
}

// -- nudge

struct NudgeVerbOptions {
  HardwareOptions hardware;
  std::string joint;
  double degrees = 3, torque = 30;
  bool yes = false;
};

// A servo cannot measure whether it was this joint, and which way it turned.
int ask_for_direction(const OpenBus& open, const std::string& joint, bool positive) {
  const auto servo = std::ranges::find(open.setup.joints, joint, &JointServo::joint);
  const std::optional<bool> right = answer_of_person(
      fmt::format("was it '{}', and did it first turn the {} way, as its axis in `doppel view`?", joint,
                  positive ? "positive" : "negative"));
  if (!right) {
    print_note("only a person sees which joint moved, and which way; without an answer the arm stays gentle");
    return 0;
  }
  if (*right) {
    const auto file = check_record_file(open.setup.component, open.link->name());
    CheckRecord record = read_check_record(file);
    add_nudged(record, *servo);
    write_check_record(file, record);
    print_line("recorded\n");
    return 0;
  }
  print_line(
      "if another joint moved, its plug or its id is wrong; if this one turned the other way, write into "
      "{}:\n"
      "{}:\n  joints:\n    {}: {{direction: {}}}   # now {}\n",
      open.setup.file.empty() ? "config/hardware.yaml" : open.setup.file.string(), open.setup.component,
      yaml_text(joint), -servo->direction, servo->direction);
  return 1;
}

int run_nudge(const NudgeVerbOptions& options) {
  OpenBus open = open_bus(options.hardware, options.joint);
  if (!confirmed(fmt::format("'{}' is about to move by {:g} degrees; is the arm supported and free?",
                             options.joint, options.degrees),
                 options.yes))
    return 1;
  Shell::catch_interrupts();
  NudgeOptions nudge_options;
  nudge_options.angle = options.degrees * kDegree;
  nudge_options.torque = options.torque / 100;
  nudge_options.ends = [] { return Shell::interrupted(); };
  const NudgeResult result = nudge(*open.bus, open.setup, options.joint, nudge_options);
  print_line("'{}' moved by {:.2f} of {:g} degrees and came back to {:+.2f}; peak load {:.0f} %\n",
             options.joint, result.moved / kDegree, options.degrees, result.returned / kDegree,
             100 * result.peak_load);
  for (const NudgeResult::Other& other : result.others)
    print_line("'{}' moved too, by {:.2f} degrees: are two plugs swapped, or is an id used twice?\n",
               other.joint, other.moved / kDegree);
  if (result.ended) return 130;
  if (!result.followed(nudge_options.angle)) {
    print_line(
        "it did not follow: is it blocked, without supply, or held by its load? --torque 60 gives it more\n");
    return 1;
  }
  if (!result.others.empty()) return 1;
  return ask_for_direction(open, options.joint, result.way > 0);
}

// -- recover

struct RecoverVerbOptions {
  HardwareOptions hardware;
  std::string joint;
  bool yes = false;
};

int run_recover(const RecoverVerbOptions& options) {
  OpenBus open = open_bus(options.hardware, options.joint);
  const Recovery plan = plan_recovery(*open.bus, open.setup, options.joint);
  if (plan.is_inside) {
    print_line("'{}' is at {:.1f} degrees, inside of its limits\n", options.joint, plan.start / kDegree);
    return 0;
  }
  if (!confirmed(
          fmt::format("'{}' is about to move from {:.1f} to {:.1f} degrees, at 5 degrees per second; is "
                      "its way free?",
                      options.joint, plan.start / kDegree, plan.goal / kDegree),
          options.yes))
    return 1;
  Shell::catch_interrupts();
  RecoveryOptions recovery;
  recovery.ends = [] { return Shell::interrupted(); };
  const Recovery result = recover(*open.bus, open.setup, options.joint, recovery);
  print_line(
      "'{}' is at {:.1f} degrees and holds{}\n", options.joint, result.end / kDegree,
      result.is_inside ? "" : "; it is still outside of its limits: is it blocked, or is its zero wrong?");
  if (result.ended) return 130;
  return result.is_inside ? 0 : 1;
}

// -- single servos

struct ServoVerbOptions {
  HardwareOptions hardware;
  std::string joint;
  bool yes = false;
};

int for_each_servo(const ServoVerbOptions& options, const std::string& question, const char* done,
                   const std::function<bool(ServoBus&, const JointServo&)>& work) {
  OpenBus open = open_bus(options.hardware, options.joint);
  const std::vector<JointServo> servos =
      options.joint.empty() ? open.setup.joints : std::vector{servo_named(open.setup, options.joint)};
  if (!confirmed(question, options.yes)) return 1;
  int failed = 0;
  for (const JointServo& one : servos) {
    const bool worked = work(*open.bus, one);
    print_line("'{}' (id {}): {}\n", one.joint, one.id, worked ? done : "no answer");
    failed += worked ? 0 : 1;
  }
  return failed == 0 ? 0 : 1;
}

int run_relax(const ServoVerbOptions& options) {
  return for_each_servo(options, "the torque goes off, and what it holds falls; is the arm supported?",
                        "torque off", [](ServoBus& bus, const JointServo& one) {
                          return bus.write(one.id, *one.model->find(ServoRole::torque_enable), 0);
                        });
}

int run_reboot(const ServoVerbOptions& options) {
  return for_each_servo(options, "servos that restart let go; is the arm supported?", "restarted",
                        [](ServoBus& bus, const JointServo& one) {
                          if (bus.protocol() == ServoProtocol::feetech)
                            throw InputError("hardware.no_reboot", {},
                                             "Feetech's servos have no restart by the bus",
                                             "switch their power off and on");
                          return bus.reboot(one.id);
                        });
}

struct ConfirmOptions {
  HardwareOptions hardware;
  std::vector<std::string> positions;
  bool yes = false;
};

using Pose = std::vector<std::pair<std::string, double>>;

Pose pose_of(const ConfirmOptions& options, const ServoSetup& setup) {
  Pose positions;
  for (const std::string& text : options.positions) {
    const std::size_t equals = text.rfind('=');
    const std::optional<double> degrees =
        equals == std::string::npos ? std::nullopt : parse_number(text.substr(equals + 1));
    if (!degrees)
      throw_usage_error(fmt::format("'{}' is no position", text), "write \"joint 1=90\", in degrees");
    positions.emplace_back(text.substr(0, equals), *degrees * kDegree);
  }
  return positions.empty() ? setup.park : positions;
}

// The running twin of this user that has the port open; nullopt: another program has it.
std::optional<RunningTwin> twin_at_port(const ServoSetup& setup) {
  const int pid = pid_with_open(port_of(setup));
  for (RunningTwin& twin : find_running()) {
    if (pid != 0 && twin.pid == pid) return std::move(twin);
  }
  return {};
}

// The twin's driver has the link to the board: it takes the pose, and turns the torque on if its start waited
// for it.
int confirm_in_twin(const RunningTwin& running, const ServoSetup& setup, const Pose& positions) {
  using doppel_msgs::srv::ConfirmPose;
  const auto twin = Shell::connect(running);
  ConfirmPose::Request request;
  request.component = setup.component;
  for (const auto& [joint, position] : positions) {
    request.joints.emplace_back(joint);
    request.positions.push_back(position);
  }
  std::vector<std::string> services;
  for (const auto& [name, service] : twin->services()) {
    if (name.ends_with("/doppel/hardware/confirm_pose")) services.push_back(name);
  }
  if (services.size() != 1)
    throw ClientError(fmt::format("'{}' (port {}) has {} robots with devices: confirm the pose on its page",
                                  running.robot, running.port, services.size()));
  const auto response = call<ConfirmPose>(*twin, services.front(), request);
  if (!response.success) throw ClientError(std::string(response.message));
  print_line("'{}' (port {}): {}\n", running.robot, running.port, std::string(response.message));
  return 0;
}

int run_confirm(const ConfirmOptions& options) {
  const ServoSetup setup = read_hardware_setup(options.hardware);
  const Pose positions = pose_of(options, setup);
  check_confirmation(setup, positions);
  const std::optional<RunningTwin> twin = twin_at_port(setup);
  const auto link = twin ? nullptr : open_servo_link(setup);
  for (const auto& [joint, position] : positions)
    print_line("  {}: {:.1f} degrees\n", joint, position / kDegree);
  if (!confirmed("does the arm stand like this? It jumps there when its torque goes on.", options.yes))
    return 1;
  if (twin) return confirm_in_twin(*twin, setup, positions);
  confirm_pose(*link, setup, positions);
  print_line("confirmed until the board loses its power\n");
  return 0;
}

struct SetIdOptions {
  std::string port, protocol = "feetech";
  int rate = 0, from = -1, id = -1;
  bool yes = false;
};

int run_set_id(const SetIdOptions& options) {
  const ServoProtocol protocol = protocols_named(options.protocol).front();
  if (protocol == ServoProtocol::servo_line) throw_usage_error("a board's channels have no ids");
  const int rate = options.rate > 0 ? options.rate : usual_rates(protocol).front();
  const auto link = open_link(options.port, rate);
  ServoBus bus(*link, protocol, rate);
  bus.notice_echo();
  const auto answer = bus.ping(options.from, 3);
  if (!answer) {
    print_note(
        fmt::format("no servo with id {} answers on {} at {} bit/s", options.from, options.port, rate));
    return 1;
  }
  const ServoModel* const model = find_servo_model(protocol, answer->number);
  if (model == nullptr)
    throw_usage_error(fmt::format("the model {} of this servo is not known", answer->number));
  if (bus.ping(options.id, 1))
    throw_usage_error(fmt::format("a servo with id {} is on the bus already", options.id));
  if (!confirmed(fmt::format("{} with id {} gets the id {}; is it the only one on the bus with its id?",
                             model->name, options.from, options.id),
                 options.yes))
    return 1;
  const ServoRegister* const lock = model->find(ServoRole::lock);
  static_cast<void>(bus.write(options.from, *model->find(ServoRole::torque_enable), 0));
  if (lock != nullptr) static_cast<void>(bus.write(options.from, *lock, 0));
  // The answer comes from the old id or from the new one.
  static_cast<void>(bus.write(options.from, *model->find(ServoRole::id), options.id, 1));
  const bool confirmed_id = bus.ping(options.id, 3).has_value();
  if (confirmed_id && lock != nullptr) static_cast<void>(bus.write(options.id, *lock, 1));
  print_line("{}\n",
             confirmed_id ? fmt::format("its id is {}", options.id) : "it does not answer with the new id");
  return confirmed_id ? 0 : 1;
}

template <class Options>
CLI::App* add(CLI::App& group, const std::string& name, const std::string& help, const std::string& examples,
              int& exit_code, const std::function<void(CLI::App&, Options&)>& declare,
              int (*run)(const Options&)) {
  CLI::App* verb = group.add_subcommand(name, help);
  verb->footer("Examples:\n  " + examples);
  const auto options = std::make_shared<Options>();
  declare(*verb, *options);
  verb->callback([&exit_code, options, run] { exit_code = run(*options); });
  return verb;
}

void add_yes(CLI::App& verb, bool& yes) {
  verb.add_flag("-y,--yes", yes, "Answer the question with yes");
}

void add_servo_verbs(CLI::App& group, int& exit_code) {
  const auto servo_options = [](CLI::App& verb, ServoVerbOptions& options) {
    add_hardware_target(verb, options.hardware);
    verb.add_option("--joint", options.joint, "Only this one");
    add_yes(verb, options.yes);
  };
  add<ServoVerbOptions>(group, "relax", "Turn the torque of servos off", "doppel hardware relax my_arm",
                        exit_code, servo_options, run_relax);
  add<ServoVerbOptions>(group, "reboot", "Restart Dynamixel servos, which clears a latched overload",
                        "doppel hardware reboot my_arm --joint joint_2", exit_code, servo_options,
                        run_reboot);
  add<ConfirmOptions>(
      group, "confirm", "Say where an arm of hobby servos stands, after its board had no power",
      "doppel hardware confirm my_arm --at joint_1=0 --at joint_2=45", exit_code,
      [](CLI::App& verb, ConfirmOptions& options) {
        add_hardware_target(verb, options.hardware);
        verb.add_option("--at", options.positions, "JOINT=DEGREES, for each joint; default: the park pose")
            ->take_all();
        add_yes(verb, options.yes);
      },
      run_confirm);
  add<SetIdOptions>(
      group, "set-id", "Give a servo another id",
      "doppel hardware set-id --serial /dev/ttyUSB0 --from 1 --id 7", exit_code,
      [](CLI::App& verb, SetIdOptions& options) {
        verb.add_option("--serial,--port", options.port, "The port of its bus")->required();
        verb.add_option("--protocol", options.protocol, "feetech or dynamixel")->capture_default_str();
        verb.add_option("--rate", options.rate, "bit/s; default: the usual one")->check(CLI::PositiveNumber);
        verb.add_option("--from", options.from, "The present id")->required()->check(CLI::Range(0, 252));
        verb.add_option("--id", options.id, "The new id")->required()->check(CLI::Range(0, 252));
        add_yes(verb, options.yes);
      },
      run_set_id);
}

void add_scan(CLI::App& group, int& exit_code) {
  add<ScanVerbOptions>(
      group, "scan", "List the ports, and what answers on each of them: protocol, rate, ids, models, supply",
      "doppel hardware scan\n  doppel hardware scan --serial /dev/ttyUSB0 --protocol feetech", exit_code,
      [](CLI::App& verb, ScanVerbOptions& options) {
        verb.add_option("--serial,--port", options.ports, "Only this port; may be repeated")
            ->type_name("PORT");
        verb.add_option("--protocol", options.protocol, "feetech, dynamixel or servo_line; default: all");
        verb.add_option("--rate", options.rate, "Only this rate, bit/s")->check(CLI::PositiveNumber);
        verb.add_option("--last-id", options.last_id, "The largest id that is tried")
            ->check(CLI::Range(0, 252));
        verb.add_flag("--json", options.json, "Print JSON to stdout");
      },
      run_scan);
}

}  // namespace

void add_hardware(CLI::App& app, int& exit_code) {
  CLI::App& group = add_group(
      app, "hardware", "Servos on a bus: find them, check them, move them for the first time",
      "doppel hardware scan\n  doppel hardware check my_arm\n  doppel hardware nudge my_arm --joint joint_2");
  add_scan(group, exit_code);
  add<CheckVerbOptions>(
      group, "check", "Compare the servos with the description: ids, models, limits, delays, supply",
      "doppel hardware check my_arm\n  doppel hardware check my_arm --fix", exit_code,
      [](CLI::App& verb, CheckVerbOptions& options) {
        add_hardware_target(verb, options.hardware);
        verb.add_flag("--fix", options.fix, "Write the registers that differ, after a question");
        verb.add_option("--backup", options.backup, "Where the former values are written")->type_name("FILE");
        add_yes(verb, options.yes);
      },
      run_bus_check);
  add<RestoreVerbOptions>(
      group, "restore", "Write registers back as they were before check --fix",
      "doppel hardware restore my_arm --file my_arm_hardware_registers.yaml", exit_code,
      [](CLI::App& verb, RestoreVerbOptions& options) {
        add_hardware_target(verb, options.hardware);
        verb.add_option("--file", options.file, "The file that check --fix wrote")->required();
        add_yes(verb, options.yes);
      },
      run_restore);
  add<NudgeVerbOptions>(
      group, "nudge", "Move one joint by 3 degrees with little torque, and see which one moves",
      "doppel hardware nudge my_arm --joint joint_2", exit_code,
      [](CLI::App& verb, NudgeVerbOptions& options) {
        add_hardware_target(verb, options.hardware);
        verb.add_option("--joint", options.joint, "The joint that moves")->required();
        verb.add_option("--degrees", options.degrees, "How far")
            ->check(CLI::Range(0.5, 10.0))
            ->capture_default_str();
        verb.add_option("--torque", options.torque, "Of the stall torque, %")
            ->check(CLI::Range(5.0, 100.0))
            ->capture_default_str();
        add_yes(verb, options.yes);
      },
      run_nudge);
  add<RecoverVerbOptions>(
      group, "recover",
      "Drive a joint that stands outside of its limits back inside, at 5 degrees per second",
      "doppel hardware recover my_arm --joint joint_2", exit_code,
      [](CLI::App& verb, RecoverVerbOptions& options) {
        add_hardware_target(verb, options.hardware);
        verb.add_option("--joint", options.joint, "The joint that is outside")->required();
        add_yes(verb, options.yes);
      },
      run_recover);
  add_servo_verbs(group, exit_code);
}

}  // namespace doppel::app
