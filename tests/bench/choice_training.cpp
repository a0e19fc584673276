// SPDX-License-Identifier: Apache-2.0
// Fits the weights of StripeChoice's evidence (sdk/src/stripe/select/choice_weights.cpp).
#include <cmath>
#include <map>
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
#include "support/random_scene.hpp"
#include "stripe/profile_extractor.hpp"
#include "stripe/select/choice_weights.hpp"

using namespace striper;

static bool g_look = false;
struct Row {
  detail::Evidence e;
  std::int32_t frame, line, kind;  // kind 0 room 1 off 2 session 3 session off
  std::uint8_t is_stripe, is_right, judged_ok, strong, visible, pad[3];
};
static std::int32_t g_frame = 0, g_kind = 0;

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
  if (g_look) { o = ScannerOptions::for_model(sim.model()); auto m = sim.model(); m.lasers[0].look = striper::testing::look_of(scene); o.stripe.expected = {expect_stripe(m, 0, o.scan)}; o.ambient.cadence = Cadence({Illumination::laser(0)}); }
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
        bool is = false;
        const double tol = std::max({2.5, 3.0 * c.sigma, 1.2 * c.width});
        for (int l = std::max(0, c.line - 2); l <= std::min(pc.lines() - 1, c.line + 2); ++l) is = is || stripe_at(l, c.across + shift, tol);
        const Row r{ch.evidence(i), g_frame, c.line, g_kind, is, 0, 0, 0, 0, {}};
        if (!ch.is_plain()) rows->push_back(r);
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
      const bool near_right = stripe_at(l, v, std::max({2.5, 3.0 * stripe.sigma_px[l], 1.2 * stripe.width_px[l]}));
      const bool ok = stripe.status[l] == ReturnStatus::kOk;
      static const bool dump = std::getenv("DUMP") != nullptr;
      static int last_piece = -1;
      if (dump && ok && !right && ch.of_line(l).candidate >= 0) {
        const int piece = pc.link(ch.of_line(l).candidate).piece;
        if (l % 5 == 0) {
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

namespace striper::detail { std::span<ChoiceTerm> dev_piece_terms(); std::span<ChoiceTerm> dev_own_terms(); }
const char* kNames[] = {"kOne","kLength","kIsShort","kSupport","kRoughness","kBends","kWide","kNarrow","kWidthSpread","kFaint","kBright","kHeightChange","kTilt","kSnr","kClipped","kCoverage","kClutter","kSubtracted","kHidden","kHiddenSupport","kClutterSupport","kWideKnown","kNarrowKnown","kCoverageShort","kClutterShort","kOwnWidth","kOwnBend","kOwnEnd","kOwnOffNear","kOwnOffFar"};
void fit(const std::vector<Row>& rows) {
  std::vector<detail::ChoiceTerm*> terms;
  for (auto& t : detail::dev_piece_terms()) terms.push_back(&t);
  const std::size_t pieces = terms.size();
  for (auto& t : detail::dev_own_terms()) terms.push_back(&t);
  const int K = static_cast<int>(terms.size());
  Eigen::VectorXf w = Eigen::VectorXf::Zero(K);
  const int n = static_cast<int>(rows.size());
  Eigen::MatrixXf X(n, K); Eigen::VectorXf y(n);
  for (int i = 0; i < n; ++i) { y[i] = rows[i].is_stripe; for (int k = 0; k < K; ++k) X(i, k) = std::max(0.0F, rows[i].e.of[terms[k]->kind] - terms[k]->knot); }
  for (int it = 0; it < 30; ++it) {
    Eigen::ArrayXf p = 1 / (1 + (-(X * w).array().max(-30.F).min(30.F)).exp());
    Eigen::VectorXf sw = (p * (1 - p)).max(1e-5F).sqrt();
    Eigen::MatrixXd H = (sw.asDiagonal() * X).transpose().cast<double>() * (sw.asDiagonal() * X).cast<double>();
    H.diagonal().array() += 0.3;
    Eigen::VectorXd g = (X.transpose() * (y.array() - p).matrix()).cast<double>() - 0.3 * w.cast<double>();
    Eigen::VectorXd d = H.ldlt().solve(g);
    w += d.cast<float>();
    if (d.norm() < 1e-3) break;
  }
  FILE* a = std::fopen("/tmp/piece_terms.inc", "w"); FILE* b = std::fopen("/tmp/own_terms.inc", "w");
  for (int k = 0; k < K; ++k) { terms[k]->weight = w[k]; std::fprintf(k < int(pieces) ? a : b, "ChoiceTerm{K::%s, %.3fF, %.3fF},\n", kNames[terms[k]->kind], terms[k]->knot, w[k]); }
  std::fclose(a); std::fclose(b);
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
    Scene room = seed % 4 == 3 ? quick_room(seed) : striper::testing::random_room(seed);
    Tally one;
    room.name = "room" + std::to_string(seed);
    g_kind = 0; run(room, 2, false, wm, out, one);
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
      g_kind = 3; run(se, 3, true, (seed / 3) % 3, out, soff);
    }
  }
  print("rooms", on);
  print("off", off);
  print("sessions", session);
  print("sessions off", soff);
}


void evaluate(const std::vector<Row>& rows, bool held_out) {
  // choose per line
  struct K { long strong=0, lines=0, found=0, wrong=0, ok=0; double brier=0; long n=0; long bins[7]={}, hits[7]={}; std::map<int,std::pair<int,int>> frames; } kind[4];
  for (std::size_t i = 0; i < rows.size();) {
    std::size_t e = i; 
    float best=-1e9F, next=-1e9F; std::size_t b=i;
    while (e < rows.size() && rows[e].frame==rows[i].frame && rows[e].line==rows[i].line) {
      const float z = detail::weigh(detail::piece_terms(), rows[e].e)+detail::weigh(detail::own_terms(), rows[e].e);
      if (z>best) { next=best; best=z; b=e; } else next=std::max(next,z);
      ++e; }
    const Row& r=rows[b];
    const bool held = (r.frame/40)%4==3;
    if (held==held_out) {
      K& k=kind[r.kind];
      const double o=std::exp(std::min(best,30.F)), q=std::exp(std::min(next,30.F)), c=o/(1+o+q);
      ++k.lines; k.strong+=r.strong; k.brier+=(c-r.is_stripe)*(c-r.is_stripe); ++k.n;
      for (int x=0;x<7;++x) if (c>=kEdges[x]&&c<kEdges[x+1]) { ++k.bins[x]; k.hits[x]+=r.is_stripe; }
      const bool ok = c>=.99 && r.judged_ok;
      k.frames[r.frame].first+=ok;
      k.ok+=ok; k.found+= ok&&r.strong&&r.is_right; k.wrong+= ok&&!r.is_right;
    }
    i=e; }
  const char* names[]={"rooms","off","sessions","sessions off"};
  for (int x=0;x<4;++x) { K& k=kind[x]; long seen=0; for (auto& f:k.frames) seen+=f.second.first>=6;
    std::printf("%-13s lines %ld strong(cand) %ld found %.2f%% ok %ld wrong %.3f%% seen %ld/%zu brier %.4f |", names[x], k.lines, k.strong, 100.0*k.found/std::max(1L,k.strong), k.ok, 100.0*k.wrong/std::max(1L,k.lines), seen, k.frames.size(), k.brier/std::max(1L,k.n));
    for (int b2=0;b2<7;++b2) std::printf(" [%.3g:%ld %.4f]", kEdges[b2], k.bins[b2], k.bins[b2]?double(k.hits[b2])/k.bins[b2]:0.0);
    std::printf("\n"); }
}

int main(int argc, char** argv) {
  const std::string mode = argv[1];  // dump | fit | test
  std::vector<Row> rows;
  if (mode == "fit") {
    for (int a = 2; a < argc; ++a) { FILE* f = std::fopen(argv[a], "rb"); Row r; while (std::fread(&r, sizeof r, 1, f) == 1) { rows.push_back(r); } std::fclose(f); }
    std::vector<Row> train, held; for (std::size_t i = 0; i < rows.size(); ++i) ((i / 20000) % 4 == 3 ? held : train).push_back(rows[i]);
    fit(train);
    long bins[7] = {}, hits[7] = {}, stripes = 0, sure = 0, wrong = 0;
    for (const Row& r : held) { const double c = 1 / (1 + std::exp(-(detail::weigh(detail::piece_terms(), r.e) + detail::weigh(detail::own_terms(), r.e))));
      stripes += r.is_stripe; sure += c >= .99 && r.is_stripe; wrong += c >= .99 && !r.is_stripe;
      for (int b = 0; b < 7; ++b) if (c >= kEdges[b] && c < kEdges[b + 1]) { ++bins[b]; hits[b] += r.is_stripe; } }
    std::printf("held %zu stripes %ld sure %.2f%% wrong sure %ld |", held.size(), stripes, 100.0 * sure / stripes, wrong);
    for (int b = 0; b < 7; ++b) std::printf(" [%.3g:%ld %.4f]", kEdges[b], bins[b], bins[b] ? double(hits[b]) / bins[b] : 0.0);
    std::printf("\n"); return 0;
  }
  const int first = std::atoi(argv[2]);
  const int count = std::atoi(argv[3]);
  if (argc > 4 && std::string(argv[4]) == "look") g_look = true;
  pass(first, count, argc > 4 && !g_look, mode == "dump" ? &rows : nullptr);
  if (mode == "dump") { FILE* f = std::fopen(argv[5], "wb"); std::fwrite(rows.data(), sizeof(Row), rows.size(), f); std::fclose(f); }
}
