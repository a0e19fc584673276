// SPDX-License-Identifier: Apache-2.0
// Fits the weights of StripeChoice's evidence (sdk/src/stripe/select/choice_weights.cpp).
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include <striper/ambient/ambient_stage.hpp>
#include <striper/pipeline/expect_stripe.hpp>
#include <striper/pipeline/scanner.hpp>
#include <striper/simulator/scene_yaml.hpp>
#include <striper/simulator/simulator.hpp>

#include "quick_rooms.hpp"
#include "stripe/profile_extractor.hpp"
#include "stripe/select/choice_weights.hpp"

using namespace striper;

struct Row {
  detail::Evidence e;
  bool is_stripe;
};

struct Tally {
  long columns = 0, strong = 0, found = 0, wrong = 0, phantom = 0, unseen = 0, frames = 0;
  double brier = 0;
  long returns = 0;
  long bins[7] = {}, hits[7] = {};
};
constexpr double kEdges[] = {0, .5, .8, .9, .95, .99, .999, 1.01};

void run(const Scene& scene, int pictures, bool off, int width_mode, std::vector<Row>* rows,
         Tally& tally) {
  Scene s = scene;
  Simulator truth_sim(scene);
  if (off)
    for (auto& l : s.lasers) l.pulse_energy_j = 1e-15;
  Simulator sim(s);
  ScannerOptions o = ScannerOptions::for_model(sim.model());
  if (width_mode == 2) o.stripe.noise.reset();
  o.ambient.cadence = Cadence({Illumination::laser(0)});
  auto ex_s = expect_stripe(sim.model(), 0, o.scan);
  o.stripe.expected = {ex_s};
  const NoiseModel noise = *sim.model().noise;
  AmbientStage stage(o.ambient);
  std::vector<Frame> frames;
  for (int p = 0; p < pictures; ++p) {
    frames.push_back(sim.render(p));
    stage.push(frames.back());
  }
  stage.finish();
  std::vector<cv::Mat> background;
  {
    Scene b = scene;
    for (auto& l : b.lasers) l.pulse_energy_j = 1e-15;
    Simulator bs(b);
    for (int p = 0; p < pictures; ++p) background.push_back(bs.expected_dn(p).clone());
  }
  std::vector<Truth> truths;
  for (int p = 0; p < pictures; ++p) truths.push_back(truth_sim.truth(p).front());
  if (width_mode == 1) {
    std::vector<double> w;
    for (const auto& l : truths[0].lines)
      if (l.status == TruthStatus::kVisible) w.push_back(l.brightest.width_px);
    if (!w.empty()) {
      std::nth_element(w.begin(), w.begin() + w.size() / 2, w.end());
      o.stripe.expected[0].sigma_px = w[w.size() / 2];
    }
  }
  detail::ProfileExtractor ex(o.stripe);
  Stripe stripe;
  int p = 0;
  while (const LitFrame* lit = stage.next()) {
    ex.extract(*lit, stripe);
    const Truth& truth = truths[p++];
    const auto& ch = ex.choice();
    const auto& pc = ch.pieces();
    ++tally.frames;
    if (!stripe.is_seen) ++tally.unseen;
    const double shift = ex.searched_from_px();
    const auto stripe_at = [&](int l, double v, double tol) {
      if (off) return false;
      const TrueLine& t = truth.lines[l];
      if (t.status != TruthStatus::kVisible) return false;
      if (std::abs(t.brightest.v_px - v) < tol) return true;
      for (const auto& q : t.others)
        if (std::abs(q.v_px - v) < tol) return true;
      return false;
    };
    if (rows)
      for (std::size_t i = 0; i < pc.size(); ++i) {
        const auto& c = pc.candidate(i);
        rows->push_back(
            {ch.evidence(i), stripe_at(c.line, c.across + shift, std::max(1.5, 3.0 * c.sigma))});
      }
    for (std::size_t l = 0; l < stripe.size(); ++l) {
      ++tally.columns;
      const TrueLine& t = truth.lines[l];
      const bool vis = !off && t.status == TruthStatus::kVisible;
      double bg = noise.black_level_dn;
      if (vis)
        bg = background[p - 1].at<float>(
            std::clamp<int>(std::lround(t.brightest.v_px), 0, background[p - 1].rows - 1), l);
      const double var = noise.variance_dn2(bg + (vis ? t.brightest.amplitude_dn : 0));
      const bool strong = vis && t.brightest.amplitude_dn / std::sqrt(var) >= 8;
      tally.strong += strong;
      const double v = stripe.across_px[l];
      const bool right = stripe_at(l, v, std::max(.5, 3.0 * stripe.sigma_px[l]));
      const bool near_right = stripe_at(l, v, std::max(1.5, 3.0 * stripe.sigma_px[l]));
      const bool ok = stripe.status[l] == ReturnStatus::kOk;
      static const bool dump = std::getenv("DUMP") != nullptr;
      static int last_piece = -1;
      if (dump && ok && !right && ch.of_line(l).candidate >= 0) {
        const int piece = pc.link(ch.of_line(l).candidate).piece;
        if (piece != last_piece) {
          const auto& pp = pc.pieces()[piece];
          std::printf(
              "%s f%d line %zu at %.2f truth %.2f(st %d edge %d A %.0f) A %.0f w %.2f/%.2f conf "
              "%.4f piece %d-%d n %d sup %d |",
              scene.name.c_str(), p - 1, l, v, t.brightest.v_px, int(t.status),
              t.brightest.near_edge, t.brightest.amplitude_dn, stripe.amplitude_dn[l],
              pc.candidate(ch.of_line(l).candidate).width, ch.width().at(v), stripe.confidence[l],
              pp.first_line, pp.last_line, pp.count, pp.support);
          const auto e = ch.evidence(ch.of_line(l).candidate);
          for (float x : e.of) std::printf(" %.2f", x);
          std::printf("\n");
        }
        last_piece = piece;
      }
      tally.found += strong && ok && right;
      if (ok && !right) {
        vis ? ++tally.wrong : ++tally.phantom;
      }
      if (verdict(stripe.status[l]) != Verdict::kMissing) {
        const double c = stripe.confidence[l];
        ++tally.returns;
        tally.brier += (c - near_right) * (c - near_right);
        for (int b = 0; b < 7; ++b)
          if (c >= kEdges[b] && c < kEdges[b + 1]) {
            ++tally.bins[b];
            tally.hits[b] += near_right;
          }
      }
    }
  }
}

void print(const char* name, const Tally& t) {
  std::printf(
      "%-22s cols %ld found %.2f%% of %ld strong, wrong %.3f%%, phantom %.3f%%, unseen %ld/%ld "
      "brier %.4f |",
      name, t.columns, 100.0 * t.found / std::max(1L, t.strong), t.strong,
      100.0 * t.wrong / t.columns, 100.0 * t.phantom / t.columns, t.unseen, t.frames,
      t.brier / std::max(1L, t.returns));
  for (int b = 0; b < 7; ++b)
    std::printf(" [%.3g:%ld %.3f]", kEdges[b], t.bins[b],
                t.bins[b] ? double(t.hits[b]) / t.bins[b] : 0.0);
  std::printf("\n");
  std::fflush(stdout);
}

void fit(const std::vector<Row>& rows) {
  constexpr int K = detail::Evidence::kCount;
  Eigen::VectorXd w = Eigen::VectorXd::Zero(K);
  for (int it = 0; it < 25; ++it) {
    Eigen::MatrixXd H = Eigen::MatrixXd::Identity(K, K) * 1.0;
    Eigen::VectorXd g = -w * 1.0;
    for (const Row& r : rows) {
      Eigen::Matrix<double, K, 1> x;
      for (int k = 0; k < K; ++k) x[k] = r.e.of[k];
      const double z = std::clamp(w.dot(x), -30.0, 30.0);
      const double p = 1 / (1 + std::exp(-z));
      g += x * ((r.is_stripe ? 1.0 : 0.0) - p);
      H += x * x.transpose() * std::max(1e-6, p * (1 - p));
    }
    const Eigen::VectorXd d = H.ldlt().solve(g);
    w += d;
    if (d.norm() < 1e-4) break;
  }
  for (int k = 0; k < K; ++k) {
    std::printf("    %.3fF,\n", w[k]);
    detail::dev_weights()[k] = w[k];
  }
}

void add(Tally& a, const Tally& b) {
  a.columns += b.columns;
  a.strong += b.strong;
  a.found += b.found;
  a.wrong += b.wrong;
  a.phantom += b.phantom;
  a.unseen += b.unseen;
  a.frames += b.frames;
  a.brier += b.brier;
  a.returns += b.returns;
  for (int i = 0; i < 7; ++i) {
    a.bins[i] += b.bins[i];
    a.hits[i] += b.hits[i];
  }
}

void pass(int first, int count, bool verbose, std::vector<Row>* out) {
  Tally on, off, session, soff;
  for (int seed = first; seed < first + count; ++seed) {
    const int wm = seed % 3;
    const Scene room = quick_room(seed);
    Tally one;
    const_cast<Scene&>(room).name = "room" + std::to_string(seed);
    run(room, 2, false, wm, out, one);
    if (verbose) {
      std::string n = "room " + std::to_string(seed);
      print(n.c_str(), one);
    }
    add(on, one);
    Tally f;
    run(room, 2, true, wm, out, f);
    if (verbose) {
      std::string n = "off " + std::to_string(seed);
      print(n.c_str(), f);
    }
    add(off, f);
    if (seed % 3 == 0) {
      const Scene se = quick_session(seed);
      Tally q;
      run(se, 6, false, (seed / 3) % 3, out, q);
      if (verbose) {
        std::string n = "session " + std::to_string(seed);
        print(n.c_str(), q);
      }
      add(session, q);
      run(se, 3, true, (seed / 3) % 3, out, soff);
    }
  }
  print("rooms", on);
  print("off", off);
  print("sessions", session);
  print("sessions off", soff);
}

int main(int argc, char** argv) {
  const std::string mode = argv[1];  // fit | test
  const int first = std::atoi(argv[2]);
  const int count = std::atoi(argv[3]);
  std::vector<Row> rows;
  pass(first, count, argc > 4, mode == "fit" ? &rows : nullptr);
  if (mode != "fit") return 0;
  std::printf("rows %zu\n", rows.size());
  fit(rows);
  pass(first + count, count / 3, false, nullptr);
}
