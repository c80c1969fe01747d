// Output to a stalled reader blocks neither the threads that print nor the end of the program.
#include "app/output_writer.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <string>
#include <thread>

#include "app/print_stderr.h"
#include "doppel/base/core/file_descriptor.h"

namespace doppel::app {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;

struct Pipe {
  Pipe() {
    std::array<int, 2> ends{};
    EXPECT_EQ(pipe2(ends.data(), O_CLOEXEC), 0);
    reader = FileDescriptor(ends[0]);
    writer = FileDescriptor(ends[1]);
  }
  // All that was written, after the writer's end.
  std::string rest() {
    writer = FileDescriptor(-1);
    std::string out;
    std::array<char, 4096> part{};
    for (ssize_t got = 0; (got = read(reader.get(), part.data(), part.size())) > 0;)
      out.append(part.data(), static_cast<std::size_t>(got));
    return out;
  }
  FileDescriptor reader{-1}, writer{-1};
};

// More than a pipe holds, in one piece.
std::string more_than_pipe_holds() {
  return std::string(100'000, 'x') + "\n";
}

TEST(OutputWriter, TextsAreWrittenInTheirOrderBeforeItsEnd) {
  Pipe pipe;
  {
    OutputWriter out(pipe.writer.get());
    out.write("one\n");
    out.write("two\n");
  }
  EXPECT_EQ(pipe.rest(), "one\ntwo\n");
}

TEST(OutputWriter, ReaderThatStandsStillDelaysNobodyAndEndGivesUp) {
  Pipe pipe;
  {
    OutputWriter out(pipe.writer.get());
    out.write(more_than_pipe_holds());
    while (out.is_idle()) std::this_thread::yield();
    out.write("after it\n");
    EXPECT_FALSE(out.is_idle());
  }
  EXPECT_THAT(pipe.rest(), testing::Not(HasSubstr("after it")));
}

TEST(OutputWriter, TextsBeyondItsBoundAreLeftOutAndCounted) {
  Pipe pipe;
  std::string read;
  std::thread reading;
  {
    OutputWriter out(pipe.writer.get());
    const std::string text = more_than_pipe_holds();
    for (std::size_t bytes = 0; bytes < 3 * OutputWriter::kMaxWaiting; bytes += text.size()) out.write(text);
    reading = std::thread([&, end = FileDescriptor(dup(pipe.reader.get()))] {
      std::array<char, 4096> part{};
      while (!read.ends_with("last\n")) {
        const ssize_t got = ::read(end.get(), part.data(), part.size());
        if (got <= 0) return;
        read.append(part.data(), static_cast<std::size_t>(got));
      }
    });
    while (!out.is_idle()) std::this_thread::yield();
    out.write("last\n");
  }
  pipe.writer = FileDescriptor(-1);
  reading.join();
  EXPECT_THAT(read, StartsWith("xxx"));
  EXPECT_THAT(read, EndsWith(" messages were dropped: this output was not read in time\nlast\n"));
}

TEST(OutputWriter, ClosedReaderAndFullDiskLoseTextAlone) {
  std::signal(SIGPIPE, SIG_IGN);  // as the program does
  Pipe pipe;
  pipe.reader = FileDescriptor(-1);
  const FileDescriptor full(open("/dev/full", O_WRONLY | O_CLOEXEC));
  OutputWriter closed(pipe.writer.get());
  OutputWriter disk(full.get());
  for (OutputWriter* const out : {&closed, &disk}) {
    out->write("lost\n");
    while (!out->is_idle()) std::this_thread::yield();
  }
}

TEST(StderrWriter, TextIsWrittenDuringItsLifeAndAfterwards) {
  testing::internal::CaptureStderr();
  {
    const StderrWriter writer;
    print_stderr("{} ", 1);
  }
  print_stderr("{}", 2);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "1 2");
}

}  // namespace
}  // namespace doppel::app
