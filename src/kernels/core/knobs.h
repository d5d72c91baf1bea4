#pragma once
#include <cstdlib>
namespace dtsdf {
inline float knob(const char* name, float value) { const char* t = std::getenv(name); return t ? (float)std::atof(t) : value; }
inline const float kShare = knob("K_SHARE", 8);       // frames of the mean of L
inline const bool kTakeBack = knob("K_TAKEBACK", 1);  // outline rule of evidence
inline const bool kByFoot = knob("K_FOOT", 0);
inline const bool kPullByL = knob("K_L", 0);
inline const bool kPullOld = knob("K_OLD", 1);        // where L does not pull
inline const float kTolerance = knob("K_TOL", 0.0f);
inline const float kCoverThrough = knob("K_CT", 1);  // covered and all through: contradict
inline const float kClipIn = knob("K_IN", 1);
inline const float kCut = knob("K_CUT", 0);
}
