// doppel bag play: a bag on a server of its own (page, Foxglove) and on the ROS 2 network.

#include <fmt/format.h>
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
#include "app/verbs/foreign_options.h"
#include "app/verbs/raw_terminal.h"
#include "doppel/ros/record/bag_player.h"
#include "doppel/ros/record/player_services.h"
#include "doppel/ros/record/qos_overrides.h"
#include "doppel/session/live/session.h"

namespace doppel::app {
namespace {

constexpr std::chrono::milliseconds kRest{10};  // between two looks for keys and requests

struct PlayOptions {
  std::string bag;
  PlayerOptions player;
  std::vector<std::string> remap;  // from:=to
  double start = 0, duration = 0, delay = 0;
  double until_seconds = 0;
  std::uint64_t until = 0;  // ns
  std::string qos_file, storage;
  bool headless = false, no_keys = false, stay = false;
  EdgeOptions edges;
  [[nodiscard]] bool has_keys() const { return !no_keys && isatty(STDIN_FILENO) != 0; }
};

PlayerOptions player_options(const PlayOptions& options) {
  PlayerOptions out = options.player;
  out.topics.check();
  out.topics.hidden = true;
  out.part = {from_seconds(options.start), from_seconds(options.duration), options.until};
  if (options.until_seconds > 0)
    out.part.until = static_cast<std::uint64_t>(from_seconds(options.until_seconds).count());
  out.delay = from_seconds(options.delay);
  if (!options.qos_file.empty()) out.qos = read_qos_overrides(options.qos_file);
  for (const std::string& text : options.remap) {
    const std::size_t split = text.find(":=");
    if (split == std::string::npos || split == 0 || split + 2 == text.size())
      throw InputError("cli.use", {}, fmt::format("--remap '{}' is not from:=to", text));
    out.remap[text.substr(0, split)] = text.substr(split + 2);
  }
  return out;
}

// The keys of ros2 bag play, and letters for them. False: the end is asked for.
bool handle_key(BagPlayer& player, char key, BagPlayer::Clock::time_point now) {
  constexpr double kFaster = 1.1;
  constexpr std::uint64_t kJump = 1'000'000'000;
  switch (key) {
    case ' ':
      player.pause(!player.is_paused(), now);
      break;
    case 'n':
    case RawTerminal::kRight:
      if (player.is_paused()) player.step(now);
      break;
    case '+':
    case RawTerminal::kUp:
      player.set_rate(std::min(player.rate() * kFaster, kMaxPlayRate), now);
      break;
    case '-':
    case RawTerminal::kDown:
      player.set_rate(std::max(player.rate() / kFaster, kMinPlayRate), now);
      break;
    case 'b':
    case RawTerminal::kLeft:
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
    if (request.speed > 0)
      player_.set_rate(std::clamp<double>(request.speed, kMinPlayRate, kMaxPlayRate), now);
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

// Until the end of the bag, a signal, or the key q.
void play(const PlayOptions& options, Bus& bus, BagPlayer& player, PlaybackControl& control) {
  const std::atomic<bool>& is_ending = stop_on_signals();
  RemoteControl remote(player, control);
  PlayerServices services(bus, player);
  std::optional<RawTerminal> terminal;
  if (options.has_keys()) terminal.emplace(STDIN_FILENO, RawTerminal::Arrows::given);
  auto shown = BagPlayer::Clock::time_point{};
  const auto is_over = [&] {
    if (options.stay || services.is_busy()) return false;
    return player.is_stopped() || (player.at_end() && !remote.is_used());
  };
  player.begin_now(BagPlayer::Clock::now());
  while (!is_ending && !is_over()) {
    remote.look();
    const auto now = BagPlayer::Clock::now();
    services.work(now);
    player.play(now);
    bus.spin();
    if (now - shown > std::chrono::milliseconds(100)) {
      show(player);
      shown = now;
    }
    const auto due = services.is_busy() ? now : std::min(player.due().value_or(now + kRest), now + kRest);
    if (terminal) {
      const auto key = terminal->next(due);
      if (key && !handle_key(player, *key, BagPlayer::Clock::now())) return;
    } else {
      bus.wait(due - BagPlayer::Clock::now());
    }
  }
  bus.spin();
}

// Throws InputError: nothing would be played.
void check_part(const PlayOptions& options, const PlayedPart& part, const BagContents& contents) {
  const double length = static_cast<double>(contents.end - contents.start) * 1e-9;
  if (options.start > length) {
    throw InputError("cli.use", make_location(options.bag),
                     fmt::format("--start-offset {:g} is behind the end of the recording, which has {:.3f} s",
                                 options.start, length));
  }
  const std::uint64_t begin = contents.start + static_cast<std::uint64_t>(part.start.count());
  if (part.until > 0 && part.until < begin && part.duration <= Duration{}) {
    throw InputError(
        "cli.use", make_location(options.bag),
        fmt::format("--playback-until ends at {} ns, before the beginning at {} ns", part.until, begin),
        "give a time of the recording's clock; doppel bag info --json has its start and end");
  }
}

int run_play(const PlayOptions& options, const RosArguments& ros) {
  BagReader bag(options.bag);
  const PlayerOptions chosen = player_options(options);
  check_selection(bag, chosen.topics);
  check_part(options, chosen.part, bag.contents());
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
  if (options.has_keys())
    print_stderr(
        "keys: space pauses, the right arrow gives the next message, b and f go a second back and on, the up "
        "and down arrows change the rate, q ends\n");
  session.begin();
  Browser browser(log);
  if (!options.headless && !options.edges.no_open) browser.open(session.server().server().page_url());
  play(options, bus, player, session.playback());
  if (isatty(STDERR_FILENO) != 0) print_stderr("\n");
  print_stderr("played {} messages\n", player.published());
  return player.skipped().empty() ? 0 : 1;
}

void add_part_options(CLI::App& verb, PlayOptions& options) {
  verb.add_option("-r,--rate", options.player.rate, "Seconds of the recording per second (default 1)")
      ->check(CLI::Range(kMinPlayRate, kMaxPlayRate));
  verb.add_option("--start-offset", options.start, "Begin so many seconds after its start")
      ->check(CLI::NonNegativeNumber);
  verb.add_option("--playback-duration", options.duration,
                  "Play so many seconds (default: to its end); with an until, the later end counts")
      ->check(positive_number());
  CLI::Option* const seconds = verb.add_option("--playback-until-sec,--playback-until", options.until_seconds,
                                               "Play until this time of the recording's clock, in seconds")
                                   ->check(positive_number());
  verb.add_option("--playback-until-nsec", options.until, "The same in nanoseconds")->excludes(seconds);
  verb.add_option("-d,--delay", options.delay, "Seconds to wait before the first message, in each loop")
      ->check(CLI::NonNegativeNumber);
}

void add_clock_options(CLI::App& verb, PlayerOptions& player) {
  verb.add_option("--clock", player.clock_rate,
                  "Publish /clock with this rate in Hz (without a number: 40), if the bag has none")
      ->expected(0, 1)
      ->default_str("40")
      ->check(positive_number());
  verb.add_option("--clock-topics", player.clock_topics, "Publish /clock before each message of these topics")
      ->take_all();
  verb.add_flag("--clock-topics-all", player.clock_topics_all, "Publish /clock before each message");
}

// Options of ros2 bag play.
constexpr ForeignOption kForeignToPlay[] = {
    {"--read-ahead-queue-size", 1, "", "messages are read when they are due"},
    {"--disable-loan-message", 0, "", "no messages are loaned"},
    {"--log-level", 1, "", "there is one level"},
    {"--storage-config-file", 1, "", "MCAP files need none to be read"},
    {"--wait-for-all-acked", 1, "the bus does not know what subscribers have acknowledged",
     "without it, reliable subscribers get the last messages while the program ends"},
    {"--publish-service-requests", 0, "recorded calls are published as events, and services are not called",
     "doppel bag resimulate repeats the calls of a twin's run"},
    {"--service-requests-source", 1, "recorded calls are published as events, and services are not called",
     "doppel bag resimulate repeats the calls of a twin's run"},
};

}  // namespace

void add_bag_play(CLI::App& bag, const RosArguments& ros, int& exit_code) {
  CLI::App* verb =
      bag.add_subcommand("play", "Publish the messages of a recording, with a page to look at it");
  const auto options = std::make_shared<PlayOptions>();
  verb->add_option("BAG", options->bag, "An .mcap file, or a folder of them")->required();
  add_part_options(*verb, *options);
  verb->add_flag("-l,--loop", options->player.loop, "Begin again at the end");
  verb->add_flag("-p,--start-paused", options->player.paused, "Begin paused; the space key goes on");
  verb->add_flag("--stay", options->stay,
                 "Stay at the end, and after the service stop, for the services seek and play");
  add_clock_options(*verb, options->player);
  verb->add_option("-m,--remap", options->remap, "Another name of a topic, from:=to")->take_all();
  add_topic_options(*verb, options->player.topics);
  verb->add_option("--qos-profile-overrides-path", options->qos_file,
                   "A YAML file with the qualities of topics, as of ros2 bag")
      ->type_name("FILE");
  verb->add_option("-s,--storage", options->storage, "The storage of the bag: mcap")
      ->check(CLI::IsMember({"mcap"}));
  verb->add_flag("--disable-keyboard-controls", options->no_keys, "No keys");
  verb->add_flag("--headless", options->headless, "Do not open the web page (same as --no-open)");
  add_edge_options(*verb, options->edges);
  add_foreign_options(*verb, kForeignToPlay);
  verb->footer(
      "The services of rosbag2's player are those of the node /rosbag2_player: pause, resume, toggle_paused, "
      "is_paused, set_rate, get_rate, play_next, burst, seek, play, stop.\n"
      "Exit code 1: topics were skipped, because their messages cannot be read.\nExamples:\n  doppel bag "
      "play my_run\n  doppel bag play my_run -r 0.5 --start-offset 12 -l\n  doppel bag play my_run -p\n"
      "  doppel service call /rosbag2_player/burst '{num_messages: 100}'\n  doppel bag play my_run --topics "
      "/tf /tf_static /robot_description -m /tf:=/old/tf");
  verb->callback([options, &ros, &exit_code] { exit_code = run_play(*options, ros); });
}

}  // namespace doppel::app
