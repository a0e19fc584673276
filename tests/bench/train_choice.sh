#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# train_choice.sh BUILD FOLDER: makes the trees of sdk/src/stripe/select/forests/ and the networks of sdk/src/stripe/report/patches/ and track/ anew.
#
# BUILD is a build folder of the release preset. FOLDER takes 22 GB of what candidates and images show; rows of before are removed from it.
# STRIPER_SHARED_DIR names the folder that holds realdata. Takes six hours of two cores. What each forest learns is said at the
# head of choice_training.cpp. The rows of each are of scenes that the others do not see (but for real images: the third's are those of
# the first, the fourth's those of all three, the fifth has none; and the clipped forest learns of the fourth's), written by a program
# that has those before it. The present ones were made so, beginning with the forests of before, which say whose positions are looked at:
# to begin with these makes others that are about as good. Of the present ones the first and the second learnt from candidates found
# without RidgesAtEdges, and the first three before clipped stripes were corrected at edges; those three saw the real set srv as green less
# red, with paths that were wrong beside the board, and sigmas without a limit. A run that stops leaves forests in the tree
# that do not belong together: `git checkout` brings those of before.
# No path has spaces.
set -euo pipefail
build=$(realpath "${1:?BUILD}") rows=$(realpath "${2:?FOLDER}")
cd "$(dirname "$0")/../.."
forests=sdk/src/stripe/select/forests
net=sdk/src/stripe/report/patches/patch_net.inc
bridges=sdk/src/stripe/track/bridge_rating.inc
training=$build/tests/bench/choice_training
python3 -c 'import numpy, torch' # Debian's python3-torch.

write() { # Each line's rows, as many at a time as there are cores.
  cmake --build "$build" --target choice_training </dev/null >/dev/null
  xargs -P "$(nproc)" -I{} sh -c "$training {}"
}
fit() { # forest trees rate weight-of-real-images prefix
  "$training" fit "$1" "$forests/$1_forest.inc" "$2" "$3" "$4" "$rows/$5_"* | tail -1
}

mkdir -p "$rows"
rm -f "$rows"/[a-z]_*
cmake --build "$build" --target choice_training >/dev/null
"$training" fit none fourth "$forests/fourth_forest.inc"
"$training" fit none fifth "$forests/fifth_forest.inc" # Nothing is sure: nothing is bridged,
"$training" fit none clipped "$forests/clipped_forest.inc" # no error widened,
python3 tests/bench/fit_patches.py $net 0 # and nothing made sure by the image,
python3 tests/bench/fit_bridges.py $bridges 0 # nor by the returns about it.
write <<END
rows $rows/f_rooms rooms 1000 220 1
rows $rows/f_unknown rooms 1300 200 1 unknown
rows $rows/f_turned rooms 1000 70 1 turned
rows $rows/f_turned_unknown rooms 1100 70 1 unknown turned
rows $rows/f_sessions sessions 1000 36 1
rows $rows/f_sessions_unknown sessions 1100 60 1 unknown
rows $rows/f_green rooms 1500 50 1 unknown green jpeg
rows $rows/f_red rooms 1560 50 1 unknown red jpeg
rows $rows/f_sessions_green sessions 1200 30 1 unknown green jpeg
rows $rows/f_sessions_red sessions 1240 30 1 unknown red jpeg
rows $rows/f_jpeg rooms 1620 50 1 jpeg
rows $rows/f_jpeg_unknown rooms 1680 50 1 unknown jpeg
real $rows/f_real 0 4
real $rows/f_real_each 0 4 each
END
fit first 300 .2 8 f
write <<END
rows $rows/z_rooms rooms 2000 650 1
rows $rows/z_unknown rooms 4000 600 1 unknown
rows $rows/z_off off 2000 120 1
rows $rows/z_off_unknown off 2200 60 1 unknown
rows $rows/z_turned rooms 5000 110 1 turned
rows $rows/z_turned_unknown rooms 5200 110 1 unknown turned
rows $rows/z_sessions sessions 2000 250 1
rows $rows/z_sessions_unknown sessions 2300 250 1 unknown
rows $rows/z_sessions_off '"off sessions"' 2900 40 2
rows $rows/z_green rooms 4000 160 1 unknown green jpeg
rows $rows/z_red rooms 4250 120 1 unknown red jpeg
rows $rows/z_green_known rooms 4400 60 1 green jpeg
rows $rows/z_more_green rooms 8600 70 1 unknown green jpeg
rows $rows/z_more_red rooms 8700 70 1 unknown red jpeg
rows $rows/z_sessions_green sessions 2000 60 3 unknown green jpeg
rows $rows/z_sessions_red sessions 2100 40 3 unknown red jpeg
rows $rows/z_sessions_green_known sessions 2200 30 3 green jpeg
rows $rows/z_more_sessions_green sessions 2600 40 1 unknown green jpeg
rows $rows/z_more_sessions_red sessions 2650 40 1 unknown red jpeg
rows $rows/z_jpeg rooms 8800 80 1 jpeg
rows $rows/z_jpeg_unknown rooms 8900 80 1 unknown jpeg
rows $rows/z_bare '"bare rooms"' 2000 60 1
rows $rows/z_bare_unknown '"bare rooms"' 4000 60 1 unknown
rows $rows/z_bright rooms 4200 60 1 unknown bright
rows $rows/z_bright_green rooms 4000 100 1 unknown green jpeg bright
rows $rows/z_bright_red rooms 4250 60 1 unknown red jpeg bright
rows $rows/z_bright_green_known rooms 4400 40 1 green jpeg bright
rows $rows/z_sessions_bright_green sessions 2000 50 3 unknown green jpeg bright
rows $rows/z_sessions_bright_red sessions 2100 25 3 unknown red jpeg bright
real $rows/z_real 2 4
real $rows/z_real_each 2 4 each
END
fit second 400 .15 12 z
"$training" fit none scatter "$forests/scatter_forest.inc" # Says nothing, as do the tails.
write <<END
rows $rows/s_rooms rooms 3000 400 1
rows $rows/s_unknown rooms 3400 350 1 unknown
rows $rows/s_more_rooms rooms 5400 440 1
rows $rows/s_more_unknown rooms 4650 340 1 unknown
rows $rows/s_sessions sessions 3000 80 4
rows $rows/s_sessions_unknown sessions 3100 80 4 unknown
rows $rows/s_jpeg rooms 3900 80 1 jpeg
rows $rows/s_green rooms 9800 60 1 unknown green jpeg
rows $rows/s_red rooms 9870 40 1 unknown red jpeg
rows $rows/s_bare '"bare rooms"' 3000 150 1
rows $rows/s_bare_unknown '"bare rooms"' 3400 120 1 unknown
rows $rows/s_bright_green rooms 9800 40 1 unknown green jpeg bright
END
fit scatter 200 .2 1 s
# Weak stripes on bare cylinders scatter a little less than this forest says; with this their pulls are one within what is allowed
# (RangeErrorBars.ArePullsOfOneInARoom, full size: .88).
sed -i 's/Bias = .*/Bias = -0.0500F;/' "$forests/scatter_forest.inc"
write <<END
rows $rows/y_rooms rooms 6000 700 1
rows $rows/y_unknown rooms 7000 600 1 unknown
rows $rows/y_off off 6000 250 1
rows $rows/y_off_unknown off 7000 120 1 unknown
rows $rows/y_turned rooms 8000 60 1 turned
rows $rows/y_turned_unknown rooms 8200 60 1 unknown turned
rows $rows/y_sessions sessions 2700 100 8
rows $rows/y_sessions_unknown sessions 3200 80 8 unknown
rows $rows/y_green rooms 9000 170 1 unknown green jpeg
rows $rows/y_red rooms 9180 120 1 unknown red jpeg
rows $rows/y_green_known rooms 6800 60 1 green jpeg
rows $rows/y_sessions_green sessions 3500 60 6 unknown green jpeg
rows $rows/y_sessions_red sessions 3570 40 6 unknown red jpeg
rows $rows/y_sessions_green_known sessions 3620 30 4 green jpeg
rows $rows/y_jpeg rooms 9400 90 1 jpeg
rows $rows/y_jpeg_unknown rooms 9500 90 1 unknown jpeg
rows $rows/y_bare '"bare rooms"' 6000 80 1
rows $rows/y_bare_unknown '"bare rooms"' 7000 60 1 unknown
rows $rows/y_bright rooms 7200 60 1 unknown bright
rows $rows/y_bright_green rooms 9000 100 1 unknown green jpeg bright
rows $rows/y_bright_red rooms 9180 60 1 unknown red jpeg bright
rows $rows/y_bright_green_known rooms 6800 40 1 green jpeg bright
rows $rows/y_sessions_bright_green sessions 3500 40 6 unknown green jpeg bright
rows $rows/y_sessions_bright_red sessions 3570 25 6 unknown red jpeg bright
real $rows/y_real 0 4
real $rows/y_real_each 0 4 each
END
fit third 700 .15 24 y
# With this a little more of the real images is found, and no more of the rooms' wrong columns than the counting error (.152 to .158 %).
sed -i 's/Bias = .*/Bias = 0.7460F;/' "$forests/third_forest.inc" # .7060 as fitted.
write <<END
rows $rows/w_rooms rooms 2700 300 1 chosen
rows $rows/w_more_rooms rooms 7600 400 1 chosen
rows $rows/w_unknown rooms 8300 300 1 unknown chosen
rows $rows/w_more_unknown rooms 600 400 1 unknown chosen
rows $rows/w_some_rooms rooms 300 250 1 chosen
rows $rows/w_some_unknown rooms 5850 150 1 unknown chosen
rows $rows/w_sessions sessions 4000 170 6 chosen
rows $rows/w_sessions_unknown sessions 4200 150 6 unknown chosen
rows $rows/w_more_sessions sessions 4800 130 6 chosen
rows $rows/w_off off 7600 200 1 chosen
rows $rows/w_off_unknown off 8300 150 1 unknown chosen
rows $rows/w_turned rooms 3760 40 1 turned chosen
rows $rows/w_turned_unknown rooms 3800 40 1 unknown turned chosen
rows $rows/w_green rooms 9600 130 1 unknown green jpeg chosen
rows $rows/w_red rooms 9730 70 1 unknown red jpeg chosen
rows $rows/w_green_known rooms 9750 40 1 green jpeg chosen
rows $rows/w_sessions_green sessions 4400 50 5 unknown green jpeg chosen
rows $rows/w_sessions_red sessions 4500 35 5 unknown red jpeg chosen
rows $rows/w_sessions_green_known sessions 4600 30 4 green jpeg chosen
rows $rows/w_jpeg rooms 200 80 1 jpeg chosen
rows $rows/w_jpeg_unknown rooms 5320 80 1 unknown jpeg chosen
rows $rows/w_bare '"bare rooms"' 7600 70 1 chosen
rows $rows/w_bare_unknown '"bare rooms"' 7800 50 1 unknown chosen
rows $rows/w_bright rooms 3840 50 1 unknown bright chosen
rows $rows/w_bright_green rooms 9600 80 1 unknown green jpeg bright chosen
rows $rows/w_bright_red rooms 9730 50 1 unknown red jpeg bright chosen
rows $rows/w_bright_green_known rooms 9750 35 1 green jpeg bright chosen
rows $rows/w_sessions_bright sessions 5200 60 5 bright chosen
rows $rows/w_sessions_jpeg sessions 5300 40 5 jpeg chosen
rows $rows/w_sessions_bright_green sessions 4700 35 5 unknown green jpeg bright chosen
rows $rows/w_sessions_bright_red sessions 4750 25 5 unknown red jpeg bright chosen
rows $rows/w_n_rooms rooms 20000 600 1 chosen
rows $rows/w_n_unknown rooms 20600 600 1 unknown chosen
rows $rows/w_n_rooms2 rooms 21200 600 1 chosen
rows $rows/w_n_unknown2 rooms 21800 600 1 unknown chosen
rows $rows/w_n_sessions sessions 22400 150 5 chosen
rows $rows/w_n_sessions_unknown sessions 22600 100 5 unknown chosen
rows $rows/w_n_green rooms 22700 160 1 unknown green jpeg chosen
rows $rows/w_n_red rooms 22900 100 1 unknown red jpeg chosen
rows $rows/w_n_bright rooms 23000 100 1 unknown bright chosen
rows $rows/w_n_off off 23100 100 1 chosen
rows $rows/w_n_off_unknown off 23200 60 1 unknown chosen
rows $rows/w_o_rooms rooms 23300 600 1 chosen
rows $rows/w_o_unknown rooms 23900 600 1 unknown chosen
rows $rows/w_o_rooms2 rooms 24500 600 1 chosen
rows $rows/w_o_unknown2 rooms 25100 600 1 unknown chosen
rows $rows/w_o_sessions sessions 25700 180 4 chosen
rows $rows/w_o_sessions_unknown sessions 25900 120 4 unknown chosen
rows $rows/w_p_rooms rooms 26100 700 1 chosen
rows $rows/w_p_unknown rooms 26800 700 1 unknown chosen
rows $rows/w_p_rooms2 rooms 27500 700 1 chosen
rows $rows/w_p_unknown2 rooms 28200 700 1 unknown chosen
rows $rows/w_p_sessions sessions 28900 250 3 chosen
rows $rows/w_p_sessions_unknown sessions 29200 150 3 unknown chosen
real $rows/w_real 0 4 chosen
real $rows/w_real_each 0 4 each chosen
real $rows/w_more_real 2 4 chosen
real $rows/w_more_real_each 2 4 each chosen
END
# A real image counts 180 times: together a few times as much as all scenes. What is said of real images that are held out was looked at.
# The present rows of w_n, w_o and w_p were written with the fourth forest of before, and lack what it bridged. Those of all scenes were
# written before errors had a limit: their sigmas, and what is right within those, were reckoned anew.
fit fourth 1000 .2 180 w
fit clipped 300 .2 1 w
write <<END
rows $rows/v_rooms rooms 33000 900 1 chosen
rows $rows/v_unknown rooms 34000 900 1 unknown chosen
rows $rows/v_sessions sessions 36500 150 4 chosen
rows $rows/v_sessions_unknown sessions 37000 120 4 unknown chosen
rows $rows/v_off off 38200 200 1 chosen
rows $rows/v_off_unknown off 38450 120 1 unknown chosen
rows $rows/v_green rooms 37500 160 1 unknown green jpeg chosen
rows $rows/v_red rooms 37700 100 1 unknown red jpeg chosen
rows $rows/v_bright rooms 38000 100 1 unknown bright chosen
rows $rows/v_bare '"bare rooms"' 38600 80 1 chosen
rows $rows/v_bare_unknown '"bare rooms"' 38700 60 1 unknown chosen
rows $rows/v_turned rooms 39300 40 1 turned chosen
rows $rows/v_jpeg rooms 39100 80 1 jpeg chosen
rows $rows/v_sessions_green sessions 38800 40 4 unknown green jpeg chosen
rows $rows/v_sessions_red sessions 38900 30 4 unknown red jpeg chosen
rows $rows/v_sessions_bright sessions 39000 50 4 bright chosen
rows $rows/v_more_rooms rooms 40000 1000 1 chosen
rows $rows/v_more_unknown rooms 41000 800 1 unknown chosen
rows $rows/v_more_sessions sessions 42000 200 3 chosen
rows $rows/v_more_rooms2 rooms 43000 1000 1 chosen
rows $rows/v_more_unknown2 rooms 44000 800 1 unknown chosen
rows $rows/v_other_sessions sessions 45000 200 3 chosen
rows $rows/v_other_sessions_unknown sessions 45300 150 3 unknown chosen
rows $rows/v_most_sessions sessions 49000 350 2 chosen
rows $rows/v_most_rooms rooms 46000 1000 1 chosen
rows $rows/v_most_unknown rooms 47500 1000 1 unknown chosen
rows $rows/v_most_sessions_unknown sessions 49500 150 2 unknown chosen
rows $rows/v_most_rooms2 rooms 50000 1000 1 chosen
rows $rows/v_most_unknown2 rooms 51000 800 1 unknown chosen
rows $rows/v_late_rooms rooms 53000 1200 1 chosen
rows $rows/v_late_unknown rooms 54500 900 1 unknown chosen
rows $rows/v_late_sessions sessions 56000 500 2 chosen
rows $rows/v_late_rooms2 rooms 58000 1200 1 chosen
rows $rows/v_late_unknown2 rooms 59500 900 1 unknown chosen
rows $rows/v_late_sessions_unknown sessions 57000 200 2 unknown chosen
rows $rows/v_late_off off 57500 100 1 chosen
rows $rows/v_late_jpeg rooms 57900 80 1 jpeg chosen
END
# Of scenes alone: the fourth has learnt the real images by heart, and what it says of them teaches nothing. The present rows but v_late were
# written with the fourth forest of before, without a clipped forest and before errors had a limit; the sigmas of what is widened or
# limited, and what is right within those, were reckoned anew. Those of v_late were written with a fourth that differs in what it learnt of
# srv alone.
fit fifth 800 .15 1 v
# What looks at the image about returns, of scenes that no forest has learnt of. The present one has learnt of images of 640x480 alone of the
# first four: this makes one that is about as good.
write <<END
patches $rows/p_rooms rooms 60500 500 1
patches $rows/p_rooms2 rooms 61000 500 1
patches $rows/p_rooms3 rooms 61500 500 1
patches $rows/p_rooms4 rooms 62000 500 1
patches $rows/p_rooms5 rooms 62500 900 1
patches $rows/p_sessions sessions 60500 450 2
patches $rows/p_off off 60500 60 1
patches $rows/p_green rooms 64500 80 1 green own jpeg
patches $rows/p_red sessions 64500 40 2 red own jpeg
patches $rows/p_bright sessions 64700 30 2 bright
patches $rows/p_bright_rooms rooms 64800 40 1 bright
patches $rows/q_rooms rooms 64250 120 1
patches $rows/q_sessions sessions 64000 60 2
END
python3 tests/bench/fit_patches.py $net 6 "$rows"/p_*.returns --check "$rows"/q_*.returns
# What rates what was measured in gaps between sure returns: first of rows that a program writes by whose networks nothing is probable
# (fit_bridges.py OUT.inc 0), then of rows that a program writes with what was fitted to the first, in whose frames what was taken is
# sure for the rest. Sessions have all their ten frames, whose boards lie differently. The present ones' d_ rows were
# written with the networks of before. The scenes that check chose limits of SureReturns and BridgedGaps, too.
write <<END
bridges $rows/b_sessions sessions 93000 100 10
bridges $rows/b_shaded sessions 77000 300 1 shaded
bridges $rows/b_rooms rooms 94000 600 1
bridges $rows/b_shaded_rooms rooms 78000 300 1 shaded
bridges $rows/b_unknown rooms 79000 150 1 unknown
END
python3 tests/bench/fit_bridges.py $bridges 10 "$rows"/b_*
write <<END
bridges $rows/d_sessions sessions 120000 130 10
bridges $rows/d_rooms rooms 121000 900 1
bridges $rows/d_sessions2 sessions 130000 130 10
bridges $rows/d_shaded_rooms rooms 123000 400 1 shaded
bridges $rows/d_shaded sessions 122000 60 6 shaded
bridges $rows/d_unknown rooms 124000 150 1 unknown
bridges $rows/d_sessions_unknown sessions 125000 25 8 unknown
bridges $rows/c_sessions sessions 96000 24 10
bridges $rows/c_rooms rooms 96000 150 1
END
python3 tests/bench/fit_bridges.py $bridges 10 "$rows"/d_* --check "$rows"/c_*
