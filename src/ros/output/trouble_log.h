/// When the status goes into the log: once for each trouble that lasts.
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "ros/common/steady_clock.h"

namespace dtsdf {

/// Who runs the node looks at its terminal, not at its status: what lacks from the start, such as
/// images on the topic that is waited for, would never be seen.
class TroubleLog {
 public:
  /// A status that is not well has to last so long, and is not logged again so soon.
  static constexpr std::chrono::seconds kLasts{5}, kAgain{60};

  /// Of each status; whether it is to be logged as a warning.
  bool update(bool is_well, const std::string& message, SteadyTime now) {
    if (is_well) {
      since_.reset();
      return false;
    }
    const std::string kind = kindOf(message);
    if (!since_ || kind != kind_) {
      since_ = now;
      kind_ = kind;
    }
    if (now - *since_ < kLasts) return false;
    const bool is_known = logged_at_ && kind == logged_kind_;
    if (is_known && (is_logged_ == since_ || now - *logged_at_ < kAgain)) return false;
    logged_at_ = now;
    logged_kind_ = kind;
    is_logged_ = since_;
    return true;
  }

 private:
  /// Without the names and numbers, which change.
  static std::string kindOf(const std::string& message) {
    return message.substr(0, message.find_first_of("'0123456789"));
  }

  std::optional<SteadyTime> since_, logged_at_;
  std::optional<SteadyTime> is_logged_;  ///< Since when the trouble was that was logged last.
  std::string kind_, logged_kind_;
};

}  // namespace dtsdf
