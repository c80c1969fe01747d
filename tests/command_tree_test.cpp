// The names of verbs' arguments: what one version of CLI11 accepts and another refuses.
#include "app/command_tree.h"

#include <gmock/gmock.h>

#include <functional>

namespace doppel::app {
namespace {

using testing::IsEmpty;

// A newer CLI11 refuses the tree when it is built: "refused".
std::vector<std::string> shared_names_of(const std::function<void(CLI::App&)>& add) {
  CLI::App app("", "program");
  try {
    add(app);
  } catch (const CLI::OptionAlreadyAdded&) {
    return {"refused"};
  }
  return shared_names(app);
}

MATCHER_P(SharedOrRefused, name, "") {
  return arg == std::vector<std::string>{name} || arg == std::vector<std::string>{"refused"};
}

TEST(CommandTree, PositionalNamedAsLongOptionIsReported) {
  std::vector<std::string> words, others;
  EXPECT_THAT(shared_names_of([&](CLI::App& app) {
                CLI::App* const record = app.add_subcommand("bag")->add_subcommand("record");
                record->add_option("topics", words);
                record->add_option("--topics", others);
              }),
              SharedOrRefused("bag record: topics"));
}

TEST(CommandTree, PositionalNamedAsShortOptionIsReported) {
  std::string a, b;
  EXPECT_THAT(shared_names_of([&](CLI::App& app) {
                CLI::App* const diff = app.add_subcommand("diff");
                diff->add_option("A", a);
                diff->add_option("-A", b);
              }),
              SharedOrRefused("diff: A"));
}

TEST(CommandTree, OptionNamedAsPositionalOfItsGroupIsReported) {
  std::string above, below;
  EXPECT_THAT(shared_names_of([&](CLI::App& app) {
                CLI::App* const group = app.add_subcommand("group");
                group->add_option("robot", above);
                group->add_subcommand("verb")->add_option("--robot", below);
              }),
              SharedOrRefused("group verb: robot"));
}

TEST(CommandTree, DistinctNamesAreAccepted) {
  std::string a, b, c;
  EXPECT_THAT(shared_names_of([&](CLI::App& app) {
                CLI::App* const verb = app.add_subcommand("verb");
                verb->add_option("TARGET", a);
                verb->add_option("-t,--target", b);
                verb->add_subcommand("below")->add_option("--target", c);
              }),
              IsEmpty());
}

}  // namespace
}  // namespace doppel::app
