#include "doppel/physics/engines/mujoco/compiled.h"

#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <new>
#include <string>

#include "doppel/base/core/file_descriptor.h"
#include "doppel/base/core/output_file.h"
#include "doppel/physics/engines/mujoco/box_contacts.h"
#include "doppel/physics/engines/mujoco/cylinder_contacts.h"
#include "doppel/physics/engines/mujoco/terrain_geoms.h"

namespace doppel {

namespace {

// The compiler of another thread may be in a loop without end; the control loop must not wait for it.
constexpr std::chrono::seconds kMaxCompileWait{5};

}  // namespace

namespace mujoco_detail {

thread_local char error_text[256] = "";

namespace {

// MuJoCo's frames hold nothing that has to be released, and have the unwind tables that the ABI requires of
// every function, so an exception passes them; the frames of this program that lie between are left properly.
[[noreturn]] void on_error(const char* text) {
  std::snprintf(error_text, sizeof error_text, "%s", text);
  throw MujocoError(text);
}

// Warnings at run time are counted in mjData::warning; MuJoCo's own handler would write a file.
void on_warning(const char* /*text*/) {}

}  // namespace

void install_handlers() {
  mju_user_error = &on_error;
  mju_user_warning = &on_warning;
}

}  // namespace mujoco_detail

namespace {

// A file with a text, in memory if the kernel supports it; MuJoCo 2 and 3 both read files by name only.
class TextFile {
 public:
  // Throws InputError "physics.no_room".
  explicit TextFile(const std::string& text) : descriptor_(memfd_create("doppel.mjcf", MFD_CLOEXEC)) {
    path_ = fmt::format("/proc/self/fd/{}", descriptor_.get());
    if (!descriptor_.is_open()) {
      const char* folder = std::getenv("TMPDIR");
      path_ = std::string(folder != nullptr ? folder : "/tmp") + "/doppel-XXXXXX";
      descriptor_ = FileDescriptor(mkstemp(path_.data()));
      on_disk_ = descriptor_.is_open();
    }
    if (descriptor_.is_open() && write_all(descriptor_.get(), text)) return;
    const int reason = errno;
    remove();
    throw InputError("physics.no_room", {},
                     fmt::format("{} bytes for the physics engine cannot be written: {}", text.size(),
                                 std::strerror(reason)),
                     "free memory, or raise the limit of the size of files (ulimit -f)");
  }
  ~TextFile() { remove(); }
  TextFile(const TextFile&) = delete;
  TextFile& operator=(const TextFile&) = delete;

  [[nodiscard]] const char* path() const { return path_.c_str(); }

 private:
  void remove() const {
    if (on_disk_) unlink(path_.c_str());
  }

  FileDescriptor descriptor_;
  bool on_disk_ = false;
  std::string path_;
};

}  // namespace

ModelHandle compile_mjcf(const std::string& mjcf, std::string& message) {
  static std::timed_mutex one_at_a_time;  // MuJoCo keeps the last parsed text in a global
#ifdef __SANITIZE_THREAD__                // of GCC 12, which does not see what is locked by the steady clock
  const std::unique_lock lock(one_at_a_time, std::chrono::system_clock::now() + kMaxCompileWait);
#else
  const std::unique_lock lock(one_at_a_time, kMaxCompileWait);
#endif
  if (!lock) {
    message = "another model has been compiled for seconds, and this one waits for it; try again later";
    return nullptr;
  }
  static std::once_flag installed;  // states on other threads read MuJoCo's tables while a world is compiled
  std::call_once(installed, [] {
    mujoco_detail::install_handlers();
    install_checked_box_contacts();
    install_cylinder_contacts();
    install_terrain_contacts();
  });
  const TextFile file(mjcf);
  std::array<char, 1024> text{};
  mjModel* model = nullptr;
  const bool whole = guarded([&model, &file, &text] {
    model = mj_loadXML(file.path(), nullptr, text.data(), static_cast<int>(text.size()));
  });
  mj_freeLastXML();
  message = whole ? text.data() : mujoco_detail::error_text;
  // The compiler ends with a step in which all free bodies are at the origin; its warnings are of that step alone.
  if (whole && model != nullptr && message.find("Time = 0.0000") != std::string::npos) message.clear();
  return ModelHandle(whole ? model : nullptr);
}

}  // namespace doppel
