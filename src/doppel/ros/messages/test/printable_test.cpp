#include "doppel/ros/messages/printable.h"

#include <gtest/gtest.h>

namespace doppel {
namespace {

TEST(Printable, ControlCharactersAreEscaped) {
  EXPECT_EQ(printable("/arm 1\nGröße"), "/arm 1\nGröße");
  EXPECT_EQ(printable("a\x1b[2J\r\x7f"), "a?[2J??");
  EXPECT_EQ(printable("\xc2\x9b"
                      "2J"),
            "?2J");
  EXPECT_EQ(printable("cut \xc3"), "cut ?");
}

TEST(Printable, NameOfBytesThatAreNoTextIsNone) {
  for (const char* name : {"home", "Größe?", " a "}) EXPECT_TRUE(is_printable_name(name)) << name;
  for (const char* name : {"", "  ", "a\nb", "a\x1b", "\xff", "cut \xc3"})
    EXPECT_FALSE(is_printable_name(name)) << name;
}

}  // namespace
}  // namespace doppel
