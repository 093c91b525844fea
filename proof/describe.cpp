// SPDX-License-Identifier: MIT
#include <array>
#include <cstdio>

#include "proof/distribution.hpp"
#include "proof/trial.hpp"

namespace bevel::proof {
namespace {

std::string number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g", value);
  return text.data();
}

std::string percent(double share) { return number(100 * share) + " %"; }

// What the physical form does differently, and what the ids on no list stand for.
struct Remark {
  const char* name;
  const char* text;
};
constexpr std::array<Remark, 39> kRemarks{{
    {"rotation_backlash", "teeth give over the last 12 % of the half clearance"},
    {"torsional_windup", "rotary elements of 6 mm in series, each with the friction of its part of the tissue"},
    {"insertion_backlash", "teeth give over the last 12 % of the half clearance"},
    {"insertion_scale", "slip uneven by 20 % over a turn of the rollers (25 mm)"},
    {"lost_steps",
     "lost one after another within 30 ms; in each recording with probability 0.45; 30 % on insertion, "
     "0.8 to 3 mm"},
    {"rate_dependence", "by the tip's own speed; bounded at rest (0.3 mm/s)"},
    {"layer", "the step is a tanh of 1.5 mm"},
    {"depth_dependence", "with the inserted length rather than the depth"},
    {"drilling", "by the tip's own rates; felt over 0.8 mm of travel"},
    {"flip_transient", "two stages, 85 % and 15 % of the length; none while retracting"},
    {"relaxation", "builds ever more slowly near its end; decays below 0.3 mm/s"},
    {"stick_slip",
     "a jump takes 4 ms, and friction of 15 % of a jump goes on meanwhile: a reversal has to overcome both"},
    {"puncture", "the tip creeps by 8 % while it is held, catches up with 40 ms"},
    {"tissue_motion", "3 % of the second harmonic"},
    {"lateral_bias", "grows along the way, by 20 % in 50 mm"},
    {"bevel_offset", ""},
    {"entry_angle", "two turns, about x and then about y"},
    {"camera_latency", "an exposure of 12 ms"},
    {"camera_scale", ""},
    {"camera_rotation", ""},
    {"refraction", "a term of fifth order, 15 %"},
    {"slip_direction", "bevel-plane, where the model file says isotropic"},
    {"slow_slip", "the shaft slips in its feeder, a share that grows with time"},
    {"curvature_drift", "curvature grows or falls with time"},
    {"roll_friction", "the tip's roll is pulled to two preferred directions"},
    {"screw", "turning the shaft also feeds it"},
    {"self_rotation", "the tip's roll drifts with depth"},
    {"camera_hysteresis", "y sags with depth and lags behind by a play of 30 mm"},
    {"camera_drift", "y drifts with time"},
    {"fibres", "curvature alternates with depth"},
    {"winding", "fibres wind onto a shaft that is turned and hold the needle straighter, until it is turned back"},
    {"side_gradient", "tissue is stiffer to one side, curvature grows that way"},
    {"axial_creep",
     "friction on the inserted length presses shaft and tissue together; both give way and recover in 0.4 and 4 s"},
    {"free_shaft_bow",
     "pushed, the shaft bows between feeder and entry (most at a quarter of its 130 mm), over 2 mm of travel; pulled, "
     "it is straight"},
    {"chuck_slip", "the shaft slips in its chuck, a share of each turn that grows with the inserted length"},
    {"oblique_interface",
     "two tissues meet at a slope of 1 in 2, the tip is led down it within some 1.5 mm; the depth is that "
     "on the insertion axis"},
    {"reloading",
     "the tissue's push on the bevel relaxes in time, and is built up again as fresh tissue is cut; none at the entry"},
    {"perspective",
     "y and z read larger as the tip comes nearer to the first camera, along x, and x along y to the second"},
    {"stand_sway", "starts and stops shake the first camera's stand along z, for a step of 10 mm/s; damping 5 %"},
}};

std::string remark_on(const std::string& name) {
  for (const Remark& remark : kRemarks)
    if (name == remark.name) return remark.text;
  return "";
}

std::string ranges_of(const EffectKind& kind) {
  std::string text;
  for (const ParameterRange& range : kind.parameters) {
    if (range.name[0] == '\0') continue;
    text += (text.empty() ? "" : ", ") + std::string(range.name) + (range.either_sign ? " +-" : " ") +
            number(range.low) + " to " + number(range.high);
  }
  return text.empty() ? "-" : text;
}

std::string table(bool listed) {
  std::string text = listed ? "| id | as the field reports | physical form: what differs from the plain one |\n"
                            : "| kind | size | what it is |\n";
  text += "| --- | --- | --- |\n";
  for (const EffectKind& kind : catalogue())
    if (kind.listed == listed)
      text += "| " + std::string(kind.name) + " | " + ranges_of(kind) + " | " + remark_on(kind.name) + " |\n";
  return text;
}

std::string changes_of_the_needle() {
  std::string text;
  for (const EffectKind& kind : needle_changes())
    text += (text.empty() ? "" : "; ") + std::string(kind.name) + " (" + ranges_of(kind) + ")";
  return text;
}

}  // namespace

std::string describe_distribution() {
  std::string shares;
  for (const ClassShare& share : kBlock)
    shares += "- " + std::string(name_of(share.trial_class)) + ": " + std::to_string(share.count) + " (" +
              percent(static_cast<double>(share.count) / kBlockSize) + ")\n";
  return "# What the blind trial draws from\n\n"
         "Printed by `bevel-blindtrial --describe`: the fourth edition. In the third (`--edition 3`) "
         "free_shaft_bow, chuck_slip, oblique_interface, reloading, perspective and stand_sway did not exist; in the "
         "second (`--edition 2`) the beam was on no list either; in the first (`--edition 1`) nor was stick_slip, and "
         "winding, side_gradient and axial_creep did not exist. "
         "Units mm, s, rad. Uniform where nothing else is said.\n\n"
         "## Classes\n\nIn every block of " +
         std::to_string(kBlockSize) + " trials, shuffled by the seed:\n\n" + shares + "\nOf the unlisted ones " +
         percent(kBeamShare) + " are the beam (below), and of the rest " + percent(kUnlistedAndListed) +
         " hold a listed effect as well. Two listed effects are never a pair that no tip tells apart (camera_rotation "
         "with entry_angle, refraction with camera_scale, layer with depth_dependence).\n\n"
         "## The needle and the lab's belief\n\n"
         "k 0.003 to 0.006, ell 18 to 30, lambda1 0.12 to 0.45, lambda2 0.03 to 0.22; published front wheel, isotropic "
         "slip. The model file handed out errs by 5 % in k, 15 % in lambda1, 20 % in lambda2 (normal, cut at two "
         "standard deviations); ell is right.\n\n"
         "The plant is the extended bicycle in a form of its own: a heading and a lateral pair that does not turn with "
         "the shaft, midpoint rule at 1 kHz. The drives have periodic errors (2 to 6 um, 1 to 4 mrad), made smaller "
         "where more than " +
         number(kRipple_sigmas) +
         " standard deviation of them could be seen in a trial.\n\n"
         "## Recordings\n\n"
         "Eight of 4 to 15 s: insertions slow and fast, stop and hold, ladder of turns at rest and while inserting, "
         "spin, retraction and re-insertion or flips, a random mixture. In " +
         percent(kPoorShare) +
         " of trials nearly only plain insertions, in which several effects cannot show. TIP_MEASUREMENT 30 Hz, "
         "ACTUATOR_STATE 50 Hz, MOTION_COMMAND 5 Hz; encoders count 0.5 um and 0.5 mrad.\n\n"
         "## Insertions that differ\n\n"
         "In a share of the trials (--varied, half unless said) every insertion has something of its own, normal: the "
         "curvature by 2 to 15 %, the heading at the entry by 0.2 to 0.7 degrees about x and y, the registration by "
         "0.05 to 0.4 mm, the bevel's roll by 0.01 to 0.06 rad (standard deviations, log-uniform between trials). "
         "What is visible is then what such variation cannot absorb either.\n\n"
         "## Two groups\n\n"
         "With --groups four of the eight kinds of insertion are made twice, by other draws, before and after; what is "
         "concealed, one thing or nothing (pairs become one), is so in those after. Beside the effects below, the "
         "needle itself may change: " +
         changes_of_the_needle() +
         ". No trial is the beam.\n\n"
         "## Camera\n\n"
         "sigma 0.10 to 0.27 in x and y, 1.3 times that in z; neighbouring frames correlate by 0, 0, 0.6, 0.6, 0.85 or "
         "0.9; of the coloured ones a quarter is AR(2) with a second coefficient of -0.35 to 0.15; in 35 % Student's t "
         "with 5 degrees of freedom; outliers 0, 1 or 2 % of 1.5 to 6 mm in any direction; lost frames 0, 2 or 5 %; "
         "late frames 0 or 3 %, by 30 to 150 ms, with the right stamp. The information in the messages is that of a "
         "sigma wrong by 10 % (log-normal).\n\n"
         "## Listed effects\n\n"
         "Each with the same probability. In " +
         percent(kNaturalShare) +
         " of cases of the size that the field reports (table); else scaled so that about 1.5 to 25 standard "
         "deviations (log-uniform) can be seen, at most to 1.5 times the drawn size; a jump of stick_slip at least to "
         "half of "
         "it: a smaller one is, in these recordings, a play of its width.\n\n" +
         table(true) +
         "\nThe plain forms are read from the effects' definitions. A physical form departs from its plain one only as "
         "far as that departure, refitted over k, lambda1, lambda2 and the effect's own parameters, stays below " +
         number(kDeparture_sigmas) +
         " standard deviations (full, a half, a quarter, a tenth, 3 %, none of it): beyond that it would itself be an "
         "effect on no list. The truth states both the share and what of it can be seen.\n\n"
         "## Effects on no list\n\n"
         "Scaled to 4 to 60 standard deviations in half of the cases.\n\n" +
         table(false) +
         "| beam | modulus 3 to 20 kPa (log-uniform), force 0.7 to 1.2 N, guide gap 0.5 to 10, in half of the cases 10 "
         "to 40 % of the tissue relaxes in 1 to 6 s | the shaft as a beam in elastic tissue that remembers its cut, "
         "written along the shaft (up to the eighteenth trial about the insertion axis, with slopes for angles) |\n"
         "\nThe truth about a beam in elastic tissue is tip_swing, bending_mm = (4 EI / modulus)^(1/4) and guide_mm, "
         "as "
         "visible as what the closest bicycle (k, lambda1, lambda2 refitted to the noise-free paths, ell drawn as "
         "above) leaves over. Where the tissue relaxes, what the closest beam in elastic tissue (modulus, force and "
         "gap "
         "refitted, by the same mechanics) leaves over is on no list. The lab's belief errs around the closest "
         "bicycle. "
         "Other effects are not put on top of a beam. Results show it as a class of its own.\n\n"
         "## Visible size, and the right answer\n\n"
         "`visible_sigmas`: the difference of the noise-free readings with and without the effect (the others given), "
         "with k, lambda1, lambda2 refitted by Gauss-Newton to absorb what they can, whitened with the true covariance "
         "of the noise over all frames of all eight recordings (outliers and the heaviness of tails apart), root of "
         "the "
         "sum of squares. An effect is visible from " +
         number(kVisible_sigmas) +
         " on. The right answer names the visible effects, \"unknown\" for those on no list, and beside them nothing "
         "but what is concealed below that.\n\n"
         "`nearest`: the parameters at which the plain forms of all visible listed effects, with k, lambda1 and "
         "lambda2, "
         "come closest to the noise-free readings. An estimate by the plain forms is about these; what was drawn "
         "differs "
         "from them by what the physical forms, the drives' periodic errors and what is too small to be named make of "
         "it. Intervals are scored against both.\n\n"
         "An unlisted effect alone in its trial is also fitted by every listed one (plain form, its parameters and k, "
         "lambda1, lambda2 free; not lost_steps, tissue_motion and stick_slip). Those that come closer than the limit "
         "are its "
         "rivals: no tool can know better from these recordings, and naming one counts as ambiguous, apart.\n\n"
         "## What binds whom\n\n"
         "A truth is bound by SHA-256 of a random salt and its text before the tool runs on its trial; so are the "
         "inputs. The tool runs in namespaces of its own: it sees the system's programs and libraries, the case "
         "read-only, and its output folder. Verdicts are hashed before truths are opened. A seed determines all "
         "trials, "
         "so a tool that knew the seed could know the truths: choose the seed after the tool is frozen.\n";
}

}  // namespace bevel::proof
