#pragma once
// Detects oscillations of joints that are held by their drives: with a numerical or physical oscillation all
// measurements are worthless, and it is easily mistaken for rest. One warning per joint.

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "doppel/base/core/source_location.h"
#include "doppel/physics/contract/engine.h"
#include "doppel/twin/loop/rest_check.h"

namespace doppel {

inline constexpr Duration kOscillationTime{200'000'000};  // tolerated duration
inline constexpr double kOscillationSags = 10.0;          // tolerated amplitude, in multiples of the sag
// Smaller amplitudes are not reported, because encoders of hobby servos do not resolve them.
inline constexpr double kMinOscillation = 1e-4, kMinSlideOscillation = 1e-5;  // rad, m
// The same while a floating base moves, which shakes what it carries, and where the gains of a controller of
// efforts or velocities hold the joint, whatever the sag is.
inline constexpr double kMinLoopOscillation = 1e-3, kMinSlideLoopOscillation = 1e-4;  // rad, m
inline constexpr double kStillBase = 5e-4;                                            // rad/s or m/s

struct Oscillation {
  int joint = -1;
  double amplitude = 0, frequency = 0;  // rad or m, half of peak to peak; Hz
  double sag = 0;                       // rad or m
  bool by_controller = false;           // a controller's gains hold the joint, not its servo
};

class OscillationWatch {
 public:
  // followed: for joints whose drive is commanded by velocity or effort; they are not watched without it.
  explicit OscillationWatch(std::shared_ptr<const Model> model, FollowedPosition followed = {})
      : model_(std::move(model)), followed_(std::move(followed)) {
    run_.joints.resize(model_->joints.size());
  }

  // After every step. Nothing is allocated.
  void look(const Instance& robot, Time now);
  // True if take() has a result.
  [[nodiscard]] bool found() const { return run_.found; }
  // The joints found since the last call; each is found once.
  std::vector<Oscillation> take();

  struct Extent {  // of q
    double low = kInfinity, high = -kInfinity;
    [[nodiscard]] double amplitude() const { return 0.5 * (high - low); }
  };
  // The consecutive windows of kOscillationTime in which a joint has oscillated.
  struct Watched {
    bool arrived = false;  // the reference has reached the target since that changed
    double target = 0;
    Time since{};                           // the window's start
    Extent early, late;                     // in the window's halves
    double before = 0;                      // the amplitude in the window before
    double sum = 0;                         // of q in all windows
    int steps = 0, turns = 0, windows = 0;  // in all windows
    bool rising = false;
    bool by_controller = false;
    bool reported = false, waiting = false;  // waiting: take() has not been called for it
    Oscillation what;
  };
  // The state that changes from step to step.
  struct Run {
    std::vector<Watched> joints;  // [joints]
    bool found = false;
    Time base_moved{};  // the last time; 0: it has not moved
  };
  [[nodiscard]] const Run& run() const { return run_; }
  void set_run(const Run& run) {
    if (run.joints.size() == run_.joints.size()) run_ = run;
  }

 private:
  static void restart(Watched& watched, Time now);
  static void open_window(Watched& watched, Time now);
  void evaluate(Watched& watched, int joint, Time now);
  [[nodiscard]] DriveState state_of(const Instance& robot, int joint) const;

  std::shared_ptr<const Model> model_;
  FollowedPosition followed_;
  Run run_;
};

// "joint 'elbow' oscillates by 0.012 rad at 250 Hz while it is held, 40 times its sag: ..." with the likely
// cause: the step, a coupling, a contact, an effort limit, the servo.
std::string to_string(const Oscillation& oscillation, const Instance& robot);

}  // namespace doppel
