# SPDX-License-Identifier: Apache-2.0
# Draws a camera image with the stripe that was found in it.
#
#   gnuplot -c apps/plot/picture.gp CAMERA.png SCANS.csv PLOT.png [FRAME]
#
# CAMERA is a PNG of 8 bits; FRAME is the first of SCANS unless given.
if (ARGC < 3) {
  print "usage: gnuplot -c picture.gp CAMERA.png SCANS.csv PLOT.png [FRAME]"
  exit status 2
}
set datafile separator comma
set datafile columnheaders
stats ARG2 using (column("frame")) name "FRAMES" nooutput
frame = ARGC >= 4 ? ARG4 + 0 : FRAMES_min
of_frame(value) = column("frame") == frame ? value : NaN

# An invisible draft tells how large the image is.
set terminal svg
set output "/dev/null"
set autoscale noextend
set datafile nocolumnheaders
plot ARG1 binary filetype=png with rgbimage
columns = int(GPVAL_X_MAX + 1.0)
rows = int(GPVAL_Y_MAX + 1.0)
set datafile columnheaders

set terminal pngcairo size columns + 120, rows + 130 font "Sans,10" background "white"
set output ARG3
set title sprintf("Frame %d: the stripe that was found in the image", frame)
set xlabel "u (px)"
set ylabel "v (px)"
set xrange [-0.5:columns - 0.5]
set yrange [rows - 0.5:-0.5]
set size ratio -1
set key outside bottom center horizontal samplen 1
# Brighter than it is: a filter and a short shutter leave all but the stripe dark.
brighter(value) = 255.0 * (value / 255.0)**0.6
plot ARG1 binary filetype=png flipy using (brighter($1)):(brighter($2)):(brighter($3)) \
       with rgbimage notitle, \
     ARG2 using (of_frame(column("u_px"))):(of_frame(column("v_px"))) with points \
       pointtype 7 pointsize 0.25 linecolor rgb "#ff5a00" title "stripe"
