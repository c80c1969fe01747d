#include "app/view_recording.h"

#include <fmt/format.h>

#include <chrono>

#include "app/browser.h"
#include "app/print_stderr.h"
#include "app/process.h"
#include "app/terminal_log.h"
#include "doppel/session/live/recording_view.h"

namespace doppel::app {
namespace {

constexpr std::chrono::milliseconds kRest{50};  // between two looks for Ctrl-C

void check_words(const std::vector<std::string>& words) {
  for (const std::string& word : words) {
    if (word.find(":=") != std::string::npos && !is_recording(word)) {
      throw InputError(
          "cli.use", {},
          fmt::format("'{}' is an argument of a description, and '{}' is a recording", word, words.front()),
          "omit it");
    }
  }
  if (words.size() > 2) {
    throw InputError(
        "cli.use", {},
        fmt::format("{} recordings are named, and the page shows one, or compares two", words.size()),
        "name the folder of a bag: all its files are shown on one time line");
  }
}

}  // namespace

int view_recording(const RecordingOptions& options, const RosArguments& ros) {
  check_words(options.words);
  std::vector<ViewedBag> bags;
  for (const std::string& word : options.words) bags.push_back(open_viewed_bag(word));
  EdgeOptions edges = options.edges;
  edges.ros.none = true;
  const SessionOptions session = session_options(edges, ros);
  const std::atomic<bool>& stop = stop_on_signals();
  const StderrWriter writer;
  TerminalLog terminal;
  Log log;
  log.add_sink(terminal.sink(ros.log_level));
  RecordingView view(bags, options.time, session.server, log);
  for (const ViewedBag& bag : bags) {
    print_stderr(
        "recording {}{}\n", bag.name,
        bag.is_folder ? fmt::format(", {} file{}", bag.files.size(), bag.files.size() > 1 ? "s" : "") : "");
    for (const std::string& note : bag.notes) print_stderr("note: {}\n", note);
  }
  print_stderr("  ready        {:.0f} ms after the start; Ctrl-C ends\n", milliseconds_since_process_start());
  print_stderr("\n  page         {}{}\n", view.page_url(),
               view.has_token() ? "  (anyone with this URL can read the recording)" : "");
  Browser browser(log);
  if (options.opens_browser) browser.open(view.page_url());
  while (!stop) view.serve(kRest);
  return 0;
}

}  // namespace doppel::app
