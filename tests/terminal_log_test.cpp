// The log of a run with a live table in the terminal, and what of it is printed afterwards.
#include "app/terminal_log.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <cstddef>
#include <string>

namespace doppel::app {
namespace {

using testing::EndsWith;
using testing::StartsWith;

std::string printed_at_end(TerminalLog& log) {
  testing::internal::CaptureStderr();
  log.table_ends();
  return testing::internal::GetCapturedStderr();
}

TEST(TerminalLog, LinesBeyondTheirNumberAreLeftOutAndCounted) {
  constexpr std::size_t kBeyond = 3;
  TerminalLog log;
  log.table_begins();
  for (std::size_t i = 0; i < TerminalLog::kMaxKept + kBeyond; ++i)
    log.add({Severity::warning, "node", fmt::format("line {}", i)});
  const std::string printed = printed_at_end(log);
  EXPECT_THAT(printed, StartsWith("  3 earlier warnings and errors are left out\n  warning: node: line 3\n"));
  EXPECT_THAT(printed, EndsWith(fmt::format("line {}\n", TerminalLog::kMaxKept + kBeyond - 1)));
  EXPECT_EQ(std::ranges::count(printed, '\n'), static_cast<std::ptrdiff_t>(TerminalLog::kMaxKept) + 1);
  EXPECT_EQ(printed_at_end(log), "") << "each is printed once";
}

TEST(TerminalLog, WarningsAndErrorsOfTableArePrintedAtItsEnd) {
  TerminalLog log;
  log.table_begins();
  for (const Severity severity : {Severity::note, Severity::warning, Severity::error})
    log.add({severity, "node", "a line"});
  EXPECT_EQ(log.recent().size(), 3U);
  EXPECT_EQ(printed_at_end(log), "  warning: node: a line\n  error: node: a line\n");
}

}  // namespace
}  // namespace doppel::app
