#include "doppel/session/session.h"

#include "doppel/session/served_files.h"

namespace doppel {

Session::Session(Bus& bus, const std::string& name, const SessionOptions& options, const Log& log)
    : assets_(std::make_shared<AssetLibrary>()),
      server_(bus, name, options.server, assets_, log),
      ros_(bus, options.network, log),
      bundled_(options.bundled) {}

TwinSession::TwinSession(Twin& twin, const SessionOptions& options, const Log& log)
    : Session(twin.bus(), twin.name(), options, log), twin_(twin) {
  assets_->offer(files());
  twin.on_robots_changed([this] {
    assets_->offer(files());
    let_go_of_gone();
  });
  if (!options.reload) return;
  const auto before = [this](const Twin::Replacement& next) {
    assets_->offer(both(served_files(Twin::instances(next)), files()));
  };
  const auto afterwards = [this] {
    assets_->offer(files());
    look();
  };
  reloader_.emplace(reloadable(twin, before, afterwards), log);
}

TwinSession::~TwinSession() {
  twin_.on_robots_changed({});
}

void TwinSession::begin() {
  look();
  ros_.open();
}

RobotFiles TwinSession::files() const {
  return served_files(twin_.engine().world().instances());
}

// A robot from text has no file to audit.
void TwinSession::look() {
  let_go_of_gone();
  for (const auto& robot : twin_.robots()) {
    const WorldRobot& asked = robot->machine().asked();
    if (asked.target.empty()) continue;
    auto& publisher = health_[asked.name_space];
    if (publisher == nullptr) {
      publisher = std::make_unique<HealthPublisher>(
          twin_.bus(), asked.name_space, [asked, bundled = bundled_] { return health_json(asked, bundled); });
    }
    publisher->look_at(robot->description());
  }
}

void TwinSession::let_go_of_gone() {
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
  look();
  if (!options.reload) return;
  const auto before = [this](const Viewer::Replacement& next) {
    assets_->offer(both(files_of(Viewer::description(next)), files_of(viewer_.description())));
  };
  reloader_.emplace(reloadable(viewer, before, [this] { look(); }), log);
}

void ViewSession::look() {
  assets_->offer(files_of(viewer_.description()));
  health_.look_at(viewer_.description());
}

}  // namespace doppel
