// SPDX-License-Identifier: MIT
#pragma once
// The filter over a bounded, time-ordered history: measurements that arrive late or out of order are applied at their
// own capture time and rolled forward, so that shuffled input gives the same state as sorted input, bit for bit.
//
// Actuator states and measurements become nodes ordered by time. A measurement between two actuator states is applied
// at positions interpolated between them; one that is newer than the newest actuator state waits for the next. Two
// actuator states farther apart than AxisLimits::gap_s are the ends of a gap: what was measured in it is not applied,
// since nobody knows where the axes were, and the state passes it by NeedleFilter::pass_gap, a declared reset.
#include <cstdint>
#include <memory>
#include <vector>

#include <bevel/estimator/past.hpp>

namespace bevel::estimator {

// Of one kind of reading.
struct ReadingCounters {
  std::int64_t offered = 0;
  std::int64_t not_usable = 0;  // status other than 0, or no axis seen
  std::int64_t too_old = 0;     // older than the history
  std::int64_t duplicate = 0;
  std::int64_t late = 0;    // arrived behind a newer node: the history was rolled back
  std::int64_t in_gap = 0;  // taken where the motion of the axes is not known (AxisLimits::gap_s): not applied
};

struct Counters {
  ReadingCounters positions, headings;
  std::int64_t relinearised = 0;
  std::int64_t actuators = 0;  // offered
  std::int64_t actuators_refused = 0;
};

// The estimate at the newest actuator state, and what the newest position said.
struct Estimate {
  std::int64_t utime = 0;  // 0: nothing yet
  FilterState state;
  model::Pose tip;  // NeedleFilter::tip_pose of it
  Update newest_update;
  std::int32_t health = 0;  // see health.hpp
};

struct HealthFinding;

class NeedleEstimator {
 public:
  // history: number of nodes kept; at 100 Hz of actuators and 2 x 30 Hz of cameras 64 nodes are 0.4 s, and 0.3 s if
  // each camera gives headings too.
  explicit NeedleEstimator(const EstimatorConfig& config, std::size_t history = 64);

  void add(const model::ActuatorState& actuator);
  void add(const model::TipMeasurement& measurement);
  void add(const model::TipHeading& heading);

  // Begins anew, a declared reset, with the next actuator state.
  void restart();
  /// Forgets how many measurements in a row were rejected, of each source. For an operator's arm command: a source that
  /// is still rejected is reported again after Gate::rejects_before_unhealthy.
  void forget_rejects();
  // The clock that stamps everything was set by so much: what is known stays, under its new times; a declared reset.
  void shift_time(std::int64_t by_us);

  // The newest estimate. `now_utime` is only for the age limits of health; pass the newest sample's time in a replay.
  Estimate estimate(std::int64_t now_utime) const;

  /// Finds the first bit of \p estimate's health word that forbids steering, with its value and its limit.
  /// @param now_utime as for the estimate
  HealthFinding finding(const Estimate& estimate, std::int64_t now_utime) const;

  // The estimate where the axes stand at `axes.utime`, a guess of now by the rates they last reported: with the
  // readings that wait for the axes, and without any trace in the history. An instant not newer than the newest node
  // gives estimate().
  Estimate estimate_ahead(const model::ActuatorState& axes, std::int64_t now_utime) const;

  // Called, if set, once for each measurement when it is first applied: for replay's statistics. Not for late
  // roll-backs.
  struct Applied {
    std::int64_t utime;
    std::int32_t camera;
    FilterState state_before;
    Update update;
    const model::TipMeasurement* measurement;  // one of the two, valid during the call
    const model::TipHeading* heading;
  };
  using Observer = void (*)(void* context, const Applied&);
  void observe(Observer observer, void* context) { observer_ = observer, observer_context_ = context; }

  const Counters& counters() const { return counters_; }
  const NeedleFilter& filter() const { return filter_; }

 private:
  /// Measurements rejected in a row: the most of one source, and of all sources together.
  struct Rejects {
    std::int32_t of_one = 0, of_all = 0;
  };
  Rejects rejects_in_row(const FilterState& state, std::int64_t now_utime) const;
  // Insertion after which the past is run again; what has come since is linear.
  static constexpr double kFirstRelinearisation_mm = 30;
  static constexpr double kRelinearisedEvery_mm = 15;
  // Less is how far an axis at rest is read differently.
  static constexpr double kDrawnBack_mm = 0.01;
  enum class Kind : std::uint8_t { actuator, position, heading };
  // Positions and status of an actuator state.
  struct Reported {
    std::int64_t utime = 0;
    double insertion_mm = 0, rotation_rad = 0;
    std::array<std::int32_t, 2> status{};
  };
  struct Node {
    std::int64_t utime = 0;
    Kind kind = Kind::actuator;
    std::int32_t camera = 0;
    std::int64_t seq = 0;
    bool applied_before = false;
    bool counted_in_gap = false;
    bool rejects_forgotten = false;  // when it is applied again, its rejection does not count
    Reported axes;                   // the newest actuator state up to it
    double insertion_mm = 0;
    double rotation_rad = 0;
    Moved moved;                        // since the node before, by the model
    model::TipMeasurement measurement;  // of a position
    model::TipHeading heading;          // of a heading
    FilterState state;
    Update update;
  };

  Node& node(std::size_t i) { return pool_[order_[i]]; }
  const Node& node(std::size_t i) const { return pool_[order_[i]]; }
  Node* insert(std::int64_t utime, Kind kind, std::int32_t camera, std::int64_t seq, std::size_t& index);
  template <class Reading>
  void add_reading(Kind kind, Reading reading, const Eigen::Matrix3d& information, Reading Node::*member);
  ReadingCounters& counters_of(Kind kind) { return kind == Kind::heading ? counters_.headings : counters_.positions; }
  void process_from(std::size_t index);
  void drop_oldest();
  void remember(const Node& before, const Node& node);
  void restart_past(const FilterState& start);
  void relinearise_if_due();
  bool interpolate(std::size_t index);
  bool is_gap(const Reported& from, const Reported& to) const;
  Estimate describe(const FilterState& state, std::int64_t utime, const Update& newest_update,
                    std::int64_t now_utime) const;

  NeedleFilter filter_;
  std::vector<Node> pool_;            // sized once
  std::vector<std::uint32_t> order_;  // indices into the pool, by time; reserved once
  std::vector<std::uint32_t> free_;
  std::size_t processed_ = 0;             // nodes before this index hold a posterior
  Past past_;                             // what has left the history, from its start or the last reset
  double known_heading_sd_rad_;           // at which the past begins
  std::unique_ptr<WalkedStep[]> walked_;  // room to run it again in: sized once, memory comes as it is used
  bool past_started_ = false;
  bool past_waits_ = false;        // for a needle that was drawn back
  bool past_begins_anew_ = false;  // then: the pose was reset meanwhile
  struct {
    double insertion_mm, rotation_rad;
  } left_{};                                 // where the axes stood when it was
  std::array<double, 2> forgotten_since_{};  // of cameras 0 and 1, since the last reading of each in it
  double past_mm_ = 0;                       // insertion and retraction in it
  double past_due_mm_ = kFirstRelinearisation_mm;
  Counters counters_;
  Update newest_update_;
  std::int64_t newest_update_utime_ = 0;
  std::int32_t resets_before_ = 0;  // declared by restarts
  bool restarted_ = false;          // the next actuator state is the first after one
  Observer observer_ = nullptr;
  void* observer_context_ = nullptr;
};

}  // namespace bevel::estimator
