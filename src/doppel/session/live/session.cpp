#include "doppel/session/live/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "doppel/base/core/names.h"
#include "doppel/control/hardware/hardware.h"
#include "doppel/control/manager/controller_manager.h"
#include "doppel/session/live/served_files.h"

namespace doppel {

Session::Session(Bus& bus, const std::string& name, const SessionOptions& options, const Log& log)
    : assets_(std::make_shared<AssetLibrary>()),
      resources_(bus, assets_),
      server_(bus, name, options.server, assets_, log),
      ros_(bus, options.network, options.move_group, log),
      bundled_(options.bundled) {}

namespace {

// Without the token, which a report must not have.
std::string without_query(const std::string& url) {
  const std::string plain = url.substr(0, url.find('?'));
  return plain.ends_with('/') ? plain : plain + "/";
}

}  // namespace

TwinSession::TwinSession(Twin& twin, const SessionOptions& options, const Log& log)
    : Session(twin.bus(), twin.name(), options, log), twin_(twin), log_(log), scenario_(options.scenario) {
  if (options.network && options.network->range != ros2::DiscoveryRange::off)
    server_.enter_domain(options.network->domain, twin.bus().nodes());
  if (options.validation)
    validation_.emplace(
        twin.bus(),
        ValidationServiceOptions{[this](const std::string& name_space) { return validated(name_space); },
                                 options.validation, without_query(server_.server().page_url())});
  if (!calibrated().empty())
    calibration_.emplace(twin.bus(), CalibrationServiceOptions{
                                         [this] { return calibrated(); },
                                         [this](const std::string& name_space, const std::string& joint) {
                                           return measured(name_space, joint);
                                         },
                                         options.bundled.robots});
  if (options.record) start_recording(*options.record, options.rewind);
  if (options.black_box) start_black_box(*options.black_box, options.rewind);
  if (options.cameras) {
    cameras_.emplace(twin.bus(), *options.cameras, log);
    log_.note("cameras", fmt::format("the pictures of the cameras are at {}", cameras_->address()));
  }
  assets_->offer(files());
  twin.keep_states(options.rewind);
  twin.on_robots_changed([this] {
    assets_->offer(files());
    remove_stale_publishers();
    if (calibration_) calibration_->update();
  });
  if (!options.reload) return;
  const auto before = [this](const Twin::Replacement& next) {
    assets_->offer(both(served_files(Twin::instances(next)), files()));
  };
  const auto afterwards = [this] {
    assets_->offer(files());
    update_audits();
    if (calibration_) calibration_->update();
  };
  reloader_.emplace(reloadable(twin, before, afterwards), log);
}

TwinSession::~TwinSession() {
  twin_.on_robots_changed({});
}

void TwinSession::begin() {
  update_audits();
  ros_.open();
}

void TwinSession::end() {
  reloader_.reset();
  validation_.reset();
  calibration_.reset();
  cameras_.reset();
  if (recorder_) recorder_->stop();
  black_box_.reset();
}

void TwinSession::start_recording(RunRecordingOptions options, bool rewind) {
  options.keeps_states = rewind;
  recorder_.emplace(twin_.bus(), run_recorder_options(twin_, std::move(options), log_), log_);
}

// An optional extra: the twin runs without it where its folders cannot be made.
void TwinSession::start_black_box(BlackBoxOptions options, bool rewind) {
  if (options.folder.empty()) return;
  options.keeps_states = rewind;
  try {
    black_box_.emplace(twin_, std::move(options), log_);
  } catch (const InputError& error) {
    log_.note("black_box", fmt::format("the last seconds are not kept: {}", error.what()));
  }
}

ValidatedRobot TwinSession::validated(const std::string& name_space) const {
  const TwinRobot* robot = twin_.find_robot(name_space);
  if (robot == nullptr && name_space.empty() && !twin_.robots().empty()) robot = twin_.robots().front().get();
  if (robot == nullptr) {
    std::vector<std::string> names;
    for (const auto& one : twin_.robots())
      if (!one->name_space().empty()) names.push_back(one->name_space());
    throw InputError("validate.robot", {},
                     fmt::format("there is no robot '{}'{}", name_space,
                                 names.empty() ? "" : did_you_mean(name_space, names)),
                     "name the namespace of a robot of this twin");
  }
  const WorldRobot& source = robot->machine().asked();
  if (source.target.empty())
    throw InputError("validate.robot", {}, "this robot has no file: it is of the world, or came by a service",
                     "write its description to a file, and run doppel validate FILE");
  ValidatedRobot out{scenario_, source.name_space, {}};
  for (const ControllerView& controller : robot->controller_manager().controllers())
    out.controllers.push_back(controller.name);
  out.scenario.robots = {source};
  out.scenario.robots.front().name_space.clear();
  if (!scenario_.complete) out.scenario.robots.front().X_WR.reset();
  out.scenario.world.reset();
  out.scenario.choices.clear();
  if (const RobotChoices* const choices = scenario_.choices_of(source)) out.scenario.choices[""] = *choices;
  // A copy has drives with their limits, and the names of the description.
  out.scenario.ideal = out.scenario.wall_stamps = false;
  out.scenario.ros.names = {};
  return out;
}

// A robot from text has no overlay.
std::vector<CalibratedRobot> TwinSession::calibrated() const {
  std::vector<CalibratedRobot> out;
  for (const auto& robot : twin_.robots()) {
    CalibratedRobot one{robot->machine().asked(), {}};
    if (one.source.target.empty()) continue;
    const ControllerManager& manager = robot->controller_manager();
    DeviceReport report;
    const std::size_t count = manager.hardware().size();
    for (std::size_t i = 0; i < count; ++i) {
      if (!manager.report(i, report)) continue;
      for (const DeviceReport::Joint& device : report.joints) {
        const Joint* const joint = robot->description().find_joint(device.name);
        if (joint != nullptr) one.joints.push_back(*joint);
      }
    }
    if (!one.joints.empty()) out.push_back(std::move(one));
  }
  return out;
}

double TwinSession::measured(const std::string& name_space, const std::string& joint) const {
  const TwinRobot* const robot = twin_.find_robot(name_space);
  if (robot == nullptr) return std::numeric_limits<double>::quiet_NaN();
  const std::string interface = joint + "/position";
  const ControllerManager& manager = robot->controller_manager();
  return manager.is_read(interface) ? manager.state(interface) : std::numeric_limits<double>::quiet_NaN();
}

RobotFiles TwinSession::files() const {
  return served_files(twin_.engine().world().instances());
}

// A robot from text has no file to audit.
void TwinSession::update_audits() {
  remove_stale_publishers();
  for (const auto& robot : twin_.robots()) {
    const WorldRobot& source = robot->machine().asked();
    if (source.target.empty()) continue;
    auto& publisher = health_[source.name_space];
    if (publisher == nullptr) publisher = make_publisher(source);
    publisher->look_at(robot->description());
  }
}

// The start does not wait for the audit, so its errors are reported when it is complete.
std::unique_ptr<HealthPublisher> TwinSession::make_publisher(const WorldRobot& robot) {
  const auto errors = std::make_shared<ErrorSummary>();
  return std::make_unique<HealthPublisher>(
      twin_.bus(), robot.name_space,
      [robot, errors, bundled = bundled_] { return health_json(robot, bundled, errors.get()); },
      [errors, &log = log_] {
        const std::optional<std::string> line = errors->take();
        if (!line) return;
        if (line->empty())
          log.note("check", "the errors of the description are fixed");
        else
          log.warning("check", *line);
      });
}

void TwinSession::remove_stale_publishers() {
  for (auto& [name_space, publisher] : health_) {
    if (twin_.find_robot(name_space) != nullptr) continue;
    publisher->retire();
    retired_.push_back(std::move(publisher));
  }
  std::erase_if(health_, [](const auto& entry) { return entry.second == nullptr; });
  // The loop does not wait for the audit of a robot that was deleted.
  std::erase_if(retired_, [](const auto& publisher) { return publisher->has_ended(); });
}

ViewSession::ViewSession(Viewer& viewer, const WorldRobot& robot, const SessionOptions& options,
                         const Log& log)
    : Session(viewer.bus(), viewer.model().name, options, log),
      viewer_(viewer),
      health_(viewer.bus(), "", [robot, bundled = bundled_] { return health_json(robot, bundled); }) {
  update_audit();
  if (!options.reload) return;
  const auto before = [this](const Viewer::Replacement& next) {
    assets_->offer(both(files_of(Viewer::description(next)), files_of(viewer_.description())));
  };
  reloader_.emplace(reloadable(viewer, before, [this] { update_audit(); }), log);
}

void ViewSession::update_audit() {
  assets_->offer(files_of(viewer_.description()));
  health_.look_at(viewer_.description());
}

}  // namespace doppel
