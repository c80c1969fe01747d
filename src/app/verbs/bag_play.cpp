// doppel bag play: a bag on a server of its own (page, Foxglove) and on the ROS 2 network.

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <memory>
#include <optional>

#include "app/browser.h"
#include "app/edge_options.h"
#include "app/number_checks.h"
#include "app/print_stderr.h"
#include "app/process.h"
#include "app/terminal_log.h"
#include "app/verbs/bag_verbs.h"
#include "app/verbs/raw_terminal.h"
#include "doppel/ros/record/bag_player.h"
#include "doppel/session/live/session.h"

namespace doppel::app {
namespace {

constexpr std::chrono::milliseconds kRest{10};  // between two looks for keys and requests

struct PlayOptions {
  std::string bag;
  PlayerOptions player;
  std::vector<std::string> remap;  // from:=to
  double start = 0, duration = 0, delay = 0;
  bool headless = false;
  EdgeOptions edges;
};

PlayerOptions player_options(const PlayOptions& options) {
  PlayerOptions out = options.player;
  out.topics.check();
  out.topics.hidden = true;
  out.start = from_seconds(options.start);
  out.duration = from_seconds(options.duration);
  for (const std::string& text : options.remap) {
    const std::size_t split = text.find(":=");
    if (split == std::string::npos || split == 0 || split + 2 == text.size())
      throw InputError("cli.use", {}, fmt::format("--remap '{}' is not from:=to", text));
    out.remap[text.substr(0, split)] = text.substr(split + 2);
  }
  return out;
}

// The keys of ros2 bag play. False: the end is asked for.
bool handle_key(BagPlayer& player, char key, BagPlayer::Clock::time_point now) {
  constexpr double kFaster = 1.1;
  constexpr std::uint64_t kJump = 1'000'000'000;
  switch (key) {
    case ' ':
      player.pause(!player.is_paused(), now);
      break;
    case 'n':
      player.step(now);
      break;
    case '+':
      player.set_rate(std::min(player.rate() * kFaster, kMaxSpeed), now);
      break;
    case '-':
      player.set_rate(std::max(player.rate() / kFaster, kMinSpeed), now);
      break;
    case 'b':
      player.seek(player.time() - std::min(player.time() - player.begin(), kJump), now);
      break;
    case 'f':
      player.seek(player.time() + kJump, now);
      break;
    case 'q':
      return false;
    default:
      break;
  }
  return true;
}

void show(const BagPlayer& player) {
  if (isatty(STDERR_FILENO) == 0) return;
  print_stderr("\r{:.2f} of {:.2f} s, {:.2g}x{}   ",
               static_cast<double>(player.time() - player.begin()) * 1e-9,
               static_cast<double>(player.end() - player.begin()) * 1e-9, player.rate(),
               player.is_paused() ? ", paused" : "");
}

foxglove::PlaybackState state_of(const BagPlayer& player) {
  using Status = foxglove::PlaybackState::Status;
  foxglove::PlaybackState out;
  out.status = player.is_paused() ? Status::paused : player.at_end() ? Status::ended : Status::playing;
  out.now = time_from_nanoseconds(static_cast<std::int64_t>(player.time()));
  out.speed = static_cast<float>(player.rate());
  return out;
}

// Foxglove's controls: requests of clients, and the state for all of them where it has changed.
class RemoteControl {
 public:
  RemoteControl(BagPlayer& player, PlaybackControl& control) : player_(player), control_(control) {}

  // A client that has asked for something may ask again at the end.
  [[nodiscard]] bool is_used() const { return used_; }

  void look() {
    const auto now = BagPlayer::Clock::now();
    for (const foxglove::PlaybackRequest& request : control_.take()) serve(request, now);
    const foxglove::PlaybackState state = state_of(player_);
    const bool is_due = now - reported_ > std::chrono::milliseconds(100) && state.now != last_.now;
    if (is_due || state.status != last_.status || state.speed != last_.speed) report(state);
  }

 private:
  void serve(const foxglove::PlaybackRequest& request, BagPlayer::Clock::time_point now) {
    used_ = true;
    if (request.seek) {
      player_.seek(static_cast<std::uint64_t>(std::max<std::int64_t>(0, nanoseconds_of(*request.seek))), now);
    } else if (request.play && player_.at_end()) {
      player_.seek(player_.begin(), now);
    }
    if (request.speed > 0) player_.set_rate(std::clamp<double>(request.speed, kMinSpeed, kMaxSpeed), now);
    player_.pause(!request.play, now);
    foxglove::PlaybackState state = state_of(player_);
    state.did_seek = request.seek.has_value();
    state.request = request.id;
    report(state);
  }

  void report(const foxglove::PlaybackState& state) {
    control_.report(state);
    last_ = state;
    reported_ = BagPlayer::Clock::now();
  }

  BagPlayer& player_;
  PlaybackControl& control_;
  foxglove::PlaybackState last_;
  BagPlayer::Clock::time_point reported_;
  bool used_ = false;
};

// Until the end of the bag, `stop`, or the key q.
void play(Bus& bus, BagPlayer& player, PlaybackControl& control, const std::atomic<bool>& stop) {
  RemoteControl remote(player, control);
  std::optional<RawTerminal> terminal;
  if (isatty(STDIN_FILENO) != 0) terminal.emplace(STDIN_FILENO);
  auto shown = BagPlayer::Clock::time_point{};
  while (!stop && (!player.at_end() || remote.is_used())) {
    remote.look();
    const auto now = BagPlayer::Clock::now();
    player.play(now);
    bus.spin();
    if (now - shown > std::chrono::milliseconds(100)) {
      show(player);
      shown = now;
    }
    const auto due = std::min(player.due().value_or(now + kRest), now + kRest);
    if (terminal) {
      const auto key = terminal->next(due);
      if (key && !handle_key(player, *key, BagPlayer::Clock::now())) return;
    } else {
      bus.wait(due - BagPlayer::Clock::now());
    }
  }
}

int run_play(const PlayOptions& options, const RosArguments& ros) {
  BagReader bag(options.bag);
  const PlayerOptions chosen = player_options(options);
  check_selection(bag, chosen.topics);
  const double length = static_cast<double>(bag.contents().end - bag.contents().start) * 1e-9;
  if (options.start > length) {
    throw InputError("cli.use", make_location(options.bag),
                     fmt::format("--start-offset {:g} is behind the end of the recording, which has {:.3f} s",
                                 options.start, length));
  }
  const std::atomic<bool>& stop = stop_on_signals();
  Log log;
  log.add_sink([](const LogLine& line) {
    print_stderr("{}: {}\n", line.severity == Severity::note ? "note" : "warning", line.text);
  });
  Bus bus;
  const std::string name = std::filesystem::path(options.bag).lexically_normal().filename().string();
  BagPlayer player(bus, bag, chosen, log);
  BagSession session(bus, name, bag, session_options(options.edges, ros), log);
  print_stderr("{}: {} messages of {} topics, {:.3f} s\n{}{}", options.bag, bag.contents().messages,
               bag.contents().topics.size(), static_cast<double>(player.end() - player.begin()) * 1e-9,
               session.banner(), session.page_line());
  if (isatty(STDIN_FILENO) != 0)
    print_stderr(
        "keys: space pauses, n the next message, b and f a second back and on, + and - the rate, q ends\n");
  session.begin();
  Browser browser(log);
  if (!options.headless && !options.edges.no_open) browser.open(session.server().server().page_url());
  if (options.delay > 0) {
    player.pause(true, BagPlayer::Clock::now());
    const auto end = BagPlayer::Clock::now() + std::chrono::duration<double>(options.delay);
    while (!stop && BagPlayer::Clock::now() < end) {
      bus.spin();
      bus.wait(kRest);
    }
    player.pause(options.player.paused, BagPlayer::Clock::now());
  }
  play(bus, player, session.playback(), stop);
  if (isatty(STDERR_FILENO) != 0) print_stderr("\n");
  print_stderr("played {} messages\n", player.published());
  return player.skipped().empty() ? 0 : 1;
}

}  // namespace

void add_bag_play(CLI::App& bag, const RosArguments& ros, int& exit_code) {
  CLI::App* verb =
      bag.add_subcommand("play", "Publish the messages of a recording, with a page to look at it");
  const auto options = std::make_shared<PlayOptions>();
  verb->add_option("BAG", options->bag, "An .mcap file, or a folder of them")->required();
  verb->add_option("-r,--rate", options->player.rate, "Seconds of the recording per second (default 1)")
      ->check(CLI::Range(kMinSpeed, kMaxSpeed));
  verb->add_option("--start-offset", options->start, "Begin so many seconds after its start")
      ->check(CLI::NonNegativeNumber);
  verb->add_option("--playback-duration", options->duration, "Play so many seconds (default: to its end)")
      ->check(positive_number());
  verb->add_option("--delay", options->delay, "Seconds to wait before the first message")
      ->check(CLI::NonNegativeNumber);
  verb->add_flag("-l,--loop", options->player.loop, "Begin again at the end");
  verb->add_flag("-p,--start-paused", options->player.paused, "Begin paused; the space key goes on");
  verb->add_option("--clock", options->player.clock_rate,
                   "Publish /clock with this rate in Hz, if the bag has none")
      ->check(positive_number());
  verb->add_option("-m,--remap", options->remap, "Another name of a topic, from:=to")->take_all();
  add_topic_options(*verb, options->player.topics);
  verb->add_flag("--headless", options->headless, "Do not open the web page (same as --no-open)");
  add_edge_options(*verb, options->edges);
  verb->footer(
      "Exit code 1: topics were skipped, because their messages cannot be read.\nExamples:\n  doppel bag "
      "play my_run\n"
      "  doppel bag play my_run -r 0.5 --start-offset 12 -l\n  doppel bag play my_run --topics /tf "
      "/tf_static "
      "/robot_description -m /tf:=/old/tf");
  verb->callback([options, &ros, &exit_code] { exit_code = run_play(*options, ros); });
}

}  // namespace doppel::app
