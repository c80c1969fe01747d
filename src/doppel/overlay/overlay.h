#pragma once
// The corrections of one description, kept beside it as NAME.overlay.yaml and applied on load by every
// command, so that a fresh export keeps them. An operation whose target is no longer what it was made for is
// reported and not applied; one whose result already stands in the description is not applied again.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/core/diagnostic.h"
#include "doppel/description/load.h"
#include "doppel/export.h"
#include "doppel/overlay/operation.h"

namespace doppel {

struct Overlay {
  std::filesystem::path file;
  std::vector<Operation> operations;
};

// Where a description's overlay is looked for: arm.xacro, arm.urdf.xacro, arm.urdf -> arm.overlay.yaml beside
// it.
DOPPEL_API std::filesystem::path overlay_path(const std::filesystem::path& description);

// Throws InputError with file:line:column; unknown keys and operations get the nearest valid one.
DOPPEL_API Overlay read_overlay(const std::filesystem::path& file);
DOPPEL_API Overlay parse_overlay(const std::string& yaml, const std::string& name);
DOPPEL_API std::string to_yaml(const Overlay& overlay);
// Atomically: the old file stays whole until the new one is.
DOPPEL_API void write_overlay(const Overlay& overlay);

enum class OperationState {
  applied,
  already_there,   // the description holds the result (it was baked, or the CAD was corrected)
  changed,         // the target is not what the operation was made for: not applied
  no_target,       // the joint or link does not exist (any more)
  no_fingerprint,  // it does not say what it was made for: not applied
};
DOPPEL_API std::string_view to_string(OperationState state);  // "applied", "already there"...

struct OperationOutcome {
  OperationState state = OperationState::applied;
  std::string message;  // why it was not applied; empty where it was
};

// Works on the expanded tree, in the overlay's order. Outcomes that are not `applied` are also warnings
// (rules "overlay.changed", "overlay.no_target", "overlay.no_fingerprint", and "overlay.impossible" where the
// tree does not allow it) or notes ("overlay.already_there") in `diagnostics`: one stale correction keeps no
// robot from loading. An angle that looks like degrees without their unit is a warning ("overlay.degrees").
DOPPEL_API std::vector<OperationOutcome> apply_overlay(const Overlay& overlay,
                                                       ExpandedDescription& description,
                                                       const PackageResolver& resolver,
                                                       Diagnostics& diagnostics);

// Fills `was` from the tree as it stands now: how a new operation gets its fingerprint. Throws InputError
// where the target does not exist, with the nearest name.
DOPPEL_API void take_fingerprint(Operation& operation, const ExpandedDescription& description);

// Adds operations to the description's overlay (made if there is none) and writes it: behind the others, and
// nothing else of the file is touched; a setting of the same values of the same target is replaced. An
// operation that stands there already is not added again. Throws InputError for one without a fingerprint.
// Returns the file.
DOPPEL_API std::filesystem::path add_to_overlay(const std::filesystem::path& description,
                                                const std::vector<Operation>& operations);

// Takes the i-th operation out of the file and leaves everything else as it stands.
DOPPEL_API void remove_from_overlay(const Overlay& overlay, std::size_t i);
// Writes the i-th operation's fingerprint, `was`, into the file; the same care.
DOPPEL_API void stamp_overlay(const Overlay& overlay, std::size_t i, const Operation& stamped);

// -- what every command loads by
// expand_description and apply_overlay of the overlay beside the file, if there is one. The overlay's file is
// among `files`. Throws InputError.
DOPPEL_API ExpandedDescription expand_corrected(const std::filesystem::path& file,
                                                const XacroArguments& arguments, PackageResolver& resolver,
                                                Diagnostics& diagnostics);
// load_description with the overlay applied.
DOPPEL_API LoadedDescription load_corrected(const std::filesystem::path& file,
                                            const XacroArguments& arguments, PackageResolver& resolver,
                                            Diagnostics& diagnostics);

}  // namespace doppel
