// generate_messages cpp|idl-DISTRO FOLDER DEFINITIONS... Writes C++ (headers and the table of types) or the
// IDL of a distribution of ROS 2 into a folder. A file that has not changed keeps its time, so that nothing
// that includes it is compiled again.

#include <fmt/format.h>

#include <cstdio>
#include <fstream>
#include <iterator>

#include "doppel/base/core/diagnostic.h"
#include "doppel/ros/messages/generator/definition.h"

namespace doppel::message_generator {
namespace {

bool has_content(const std::filesystem::path& file, const std::string& content) {
  std::ifstream stream(file, std::ios::binary);
  return stream && std::string(std::istreambuf_iterator<char>(stream), {}) == content;
}

void write_changed(const std::filesystem::path& file, const std::string& content) {
  if (has_content(file, content)) return;
  std::ofstream stream(file, std::ios::binary);
  stream << content << std::flush;
  if (!stream)
    throw InputError("messages.unwritable", make_location(file.string()), "the file cannot be written",
                     "check the folder's permissions and the free space");
}

int run(std::span<char*> arguments) {
  constexpr std::string_view kIdl = "idl-";
  const std::string_view form = arguments.size() > 3 ? arguments[1] : "";
  const std::optional<Distro> distro =
      form.starts_with(kIdl) ? distro_of(form.substr(kIdl.size())) : std::nullopt;
  if (form != "cpp" && !distro) {
    fmt::print(stderr, "usage: generate_messages cpp|idl-DISTRO FOLDER DEFINITIONS...\n");
    return 2;
  }
  try {
    const std::filesystem::path folder = arguments[2];
    const std::vector<std::filesystem::path> files(arguments.begin() + 3, arguments.end());
    const Definitions definitions = read_definitions(files);
    std::filesystem::create_directories(folder);
    for (const auto& [name, content] : distro ? idl_files(definitions, *distro) : cpp_files(definitions))
      write_changed(folder / name, content);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
}

}  // namespace
}  // namespace doppel::message_generator

int main(int count, char** arguments) {
  return doppel::message_generator::run({arguments, static_cast<std::size_t>(count)});
}
