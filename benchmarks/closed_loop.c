/* The method of experiments/engine in plain C, written for one loop: what the engine's speed is measured against.

   Every step is the recursion x_{p+1} = step/(p + 1) (A x_p + B m_p + D w_p), term by term, as straight code for the
   entries of the loop that are not zero: of second-order sections in series no more are. That code, N, K, WATCHED, MOST,
   rate_0 and rate_1 (unsaturated and saturated), signals_0 ... and watched_0 ..., is in loop.h, which compiled_c.py
   writes. References in pieces, brief dead times and rate limits are left out: the benchmark has none. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "loop.h"

#define ORDER 60
#define NEGLIGIBLE 1e-14
#define ROUNDING 1e-16
#define NOTHING 1e-30
#define DIVERGENT 1e100
#define BEYOND 0.5
#define JUMP 1e-9

static double binomial[ORDER + 1][ORDER + 1], factorial[ORDER + 1], inverse[ORDER + 1];

static inline double dot(const double *restrict row, const double *restrict z, int count) {
    double value = 0.0;
    for (int c = 0; c < count; c++) value += row[c] * z[c];
    return value;
}

static double horner(const double *c, int degree, double tau) {
    double value = 0.0;
    for (int i = degree; i >= 0; i--) value = value * tau + c[i];
    return value;
}

static void shift(double *restrict c, int degree, double delta) {
    double derivatives[ORDER + 1], weights[ORDER + 1], power = 1.0;
    for (int i = 0; i <= degree; i++, power *= delta) {
        derivatives[i] = factorial[i] * c[i];
        weights[i] = power * inverse[i];
    }
    for (int m = 0; m <= degree; m++) c[m] = dot(derivatives + m, weights, degree + 1 - m) * inverse[m];
}

static double gap(double *left, int left_degree, double moved, const double *right, int right_degree) {
    double most = 0.0, power = 1.0;
    shift(left, left_degree, moved);
    for (int i = 0; i <= left_degree || i <= right_degree; i++, power *= 0.5)
        most += fabs((i <= left_degree ? left[i] : 0.0) - (i <= right_degree ? right[i] : 0.0)) * power;
    return most;
}

static int sign_changes(const double *b, int n) {
    int changes = 0, last = 0;
    for (int i = 0; i <= n; i++) {
        int sign = (b[i] > 0) - (b[i] < 0);
        if (sign) {
            changes += last && sign != last;
            last = sign;
        }
    }
    return changes;
}

static double root(const double *g, int n, double lo, double hi) {
    double tau = 0.5 * (lo + hi);
    for (int trial = 0; trial < 200; trial++) {
        double value = 0.0, slope = 0.0;
        for (int i = n; i >= 0; i--) {
            slope = slope * tau + value;
            value = value * tau + g[i];
        }
        if (value > 0) lo = tau; else hi = tau;
        double next = slope != 0 ? tau - value / slope : 0.5 * (lo + hi);
        if (!(lo < next && next < hi)) next = 0.5 * (lo + hi);
        if (fabs(next - tau) <= 1e-16 * (1 + fabs(tau)) || hi - lo <= 1e-16) return next;
        tau = next;
    }
    return tau;
}

static double first_exit(const double *g, int n, double length) {
    double slack = g[0], power = 1.0;
    for (int i = 1; i <= n; i++) {
        power *= length;
        slack -= fabs(g[i]) * power;
    }
    if (slack > 0) return -1.0;
    double stack[64][ORDER + 1], left[64], right[64], b[ORDER + 1], first[ORDER + 1];
    double scaled[ORDER + 1];
    power = 1.0;
    for (int i = 0; i <= n; i++, power *= length) scaled[i] = g[i] * power / binomial[i][n];
    for (int j = 0; j <= n; j++) {
        double value = 0.0;
        for (int i = 0; i <= j; i++) value += binomial[i][j] * scaled[i];
        stack[0][j] = value;
    }
    left[0] = 0.0, right[0] = length;
    for (int depth = 1; depth-- > 0;) {
        memcpy(b, stack[depth], (n + 1) * sizeof *b);
        double lo = left[depth], hi = right[depth];
        int changes = sign_changes(b, n);
        if (changes == 0) {
            if (b[0] < 0 || b[n] < 0) return lo;
            continue;
        }
        if (changes == 1 && b[0] >= 0 && b[n] <= 0) return root(g, n, lo, hi);
        if (hi - lo < 1e-12 * length) {
            if (b[n] < 0) return lo;
            continue;
        }
        for (int level = 0; level <= n; level++) {
            first[level] = b[0];
            for (int j = 0; j < n - level; j++) b[j] = 0.5 * (b[j] + b[j + 1]);
        }
        double middle = 0.5 * (lo + hi);
        memcpy(stack[depth], b, (n + 1) * sizeof *b), left[depth] = middle, right[depth] = hi;
        memcpy(stack[depth + 1], first, (n + 1) * sizeof *b), left[depth + 1] = lo, right[depth + 1] = middle;
        depth += 2;
    }
    return -1.0;
}

static double leave(const double *U, int degree, int mode, int on_limit, int stuck, double low, double high,
                    double reach, int *entered, int *crossed) {
    double best = -1.0, swing = 0.0, power = 1.0, g[ORDER + 1];
    *entered = mode, *crossed = 0;
    for (int i = 1; i <= degree; i++) {
        power *= reach;
        swing += fabs(U[i]) * power;
    }
    if (!on_limit && ((mode == 1 && U[0] - high > swing) || (mode == -1 && low - U[0] > swing))) return best;
    if (!on_limit && mode == 0 && high - U[0] > swing && U[0] - low > swing) return best;
    for (int side = 1; side >= -1; side -= 2) {
        double limit = side == 1 ? high : low;
        if (isinf(limit) || (mode && mode != side)) continue;
        double sign = mode == 0 ? -side : side;
        for (int i = 0; i <= degree; i++) g[i] = sign * U[i];
        g[0] -= sign * limit;
        if (on_limit == side) {
            for (int i = 0; i < degree; i++) g[i] = g[i + 1];
            g[degree] = 0.0;
            if (stuck && g[0] <= 0) continue;
        }
        double found = g[0] < 0 ? 0.0 : first_exit(g, degree, reach);
        if (found >= 0 && (best < 0 || found < best)) {
            best = found, *entered = mode == 0 ? side : 0;
            *crossed = -g[0] > JUMP * (fabs(limit) + fabs(U[0])) ? 0 : side;
        }
    }
    return best;
}

static int insert(double *queue, int queued, double t, double near) {
    int k = queued;
    while (k > 0 && queue[k - 1] > t) k--;
    if ((k > 0 && t - queue[k - 1] <= near) || (k < queued && queue[k] - t <= near)) return queued;
    memmove(queue + k + 1, queue + k, (queued - k) * sizeof *queue);
    queue[k] = t;
    return queued + 1;
}

/* The number of events; values (1 + WATCHED, count), events (most_events,). -1: divergence, -2: too little room. */
int integrate(const double *influence, const double *delays, const double *x0, double low, double high, double horizon,
              double step, const double *samples, const int64_t *groups, int lags, int count, int most_events, int room,
              double *values, double *events) {
    int pieces = 0, event_count = 0, wrap = room - 1;
    for (int i = 0; i <= ORDER; i++) /* binomial[i][n] = n over i: rows that run with n */
        for (int m = 0; m <= ORDER; m++)
            binomial[i][m] = i == 0 ? 1.0 : m == 0 ? 0.0 : binomial[i - 1][m - 1] + binomial[i][m - 1];
    for (int i = 0; i <= ORDER; i++) factorial[i] = i ? i * factorial[i - 1] : 1.0, inverse[i] = 1.0 / factorial[i];
    double *starts = malloc(room * sizeof *starts), *radii = malloc(room * sizeof *radii);
    double *lates = malloc(room * sizeof *lates), late = 0.0, *queue = malloc(room * sizeof *queue);
    int *degrees = malloc(room * sizeof *degrees), queued = 0, cursor[K + 1] = {0}, sample[K + 2] = {0};
    double(*history)[K][MOST + 1] = malloc(room * sizeof *history);
    static double V[MOST + 2][N + 1 + K], S[MOST + 2][1 + K], O[MOST + 2][WATCHED + 1];
    double W[K][ORDER + 1], P[1 + K][ORDER + 1], x[N], scale[N], size[1 + K] = {0}, negligible[1 + K], rest[K + 1];
    memset(V, 0, sizeof V);
    memcpy(V[0], x0, N * sizeof **V);
    signals_0(V[0], S[0]);
    for (int j = 0; j < K; j++) rest[j] = S[0][1 + j];
    for (int j = 0; j < K; j++) V[0][N + 1 + j] = rest[j], size[1 + j] = fabs(rest[j]);
    for (int r = 0; r < N; r++) x[r] = x0[r], scale[r] = fabs(x0[r]);
    watched_0(V[0], O[0]);
    for (int g = 0; g < lags; g++)
        for (; sample[g] < count && samples[g * count + sample[g]] < 0; sample[g]++)
            for (int o = groups[g]; o < groups[g + 1]; o++) values[(1 + o) * count + sample[g]] = O[0][o];
    signals_0(V[0], S[0]);
    double u = S[0][0], t = 0.0;
    int mode = u > high ? 1 : u < low ? -1 : 0, kink = 1, on_limit = 0, standing = 0, result = 0, usual = 0;

    while (t < horizon && !result) {
        double t_next = fmin(t + step, horizon), radius;
        if (queued && queue[0] - t < step * (1 + 1e-9)) t_next = fmin(queue[0], horizon);
        int known = 0, degree, quiet = 0, filled[K + 1];
        for (int j = 0; j < K; j++) {
            double start = t - delays[j], middle = start + 0.5 * (t_next - t);
            filled[j] = 0;
            if (middle < 0) {
                W[j][0] = rest[j];
                continue;
            }
            while (cursor[j] + 1 < pieces && starts[(cursor[j] + 1) & wrap] <= middle) cursor[j]++;
            int piece = cursor[j] & wrap;
            if (starts[piece] + radii[piece] * step + delays[j] < t_next - 1e-9 * step)
                t_next = starts[piece] + radii[piece] * step + delays[j];
            degree = degrees[piece];
            memcpy(W[j], history[piece][j], (degree + 1) * sizeof **W);
            double moved = start - starts[piece] + (late - lates[piece]);
            if (fabs(moved) > 4e-16 * (step + t)) shift(W[j], degree, moved / step);
            radius = fmin(1.0, (t_next - t) / step + BEYOND);
            double power = radius == 1.0 ? 1.0 : pow(radius, degree);
            for (; degree > 0 && fabs(W[j][degree]) * power <= NEGLIGIBLE * size[1 + j]; degree--) power /= radius;
            filled[j] = degree;
            if (degree > known) known = degree;
        }
        for (int j = 0; j < K; j++)
            for (int i = 0; i <= known; i++) V[i][N + 1 + j] = i <= filled[j] ? W[j][i] : 0.0;
        memcpy(V[0], x, N * sizeof *x);
        V[0][N] = mode == 0 ? 0.0 : mode == 1 ? high : low;
        double power = 1.0;
        radius = fmin(1.0, (t_next - t) / step + BEYOND);
        for (degree = 0;; degree++, power *= radius) {
            int small = degree > known;
            if (degree > known) memset(V[degree] + N + 1, 0, K * sizeof **V);
            if (degree > 0) V[degree][N] = 0.0;
            if (mode) signals_1(V[degree], S[degree]), rate_1(V[degree], S[degree], step / (degree + 1), V[degree + 1]);
            else signals_0(V[degree], S[degree]), rate_0(V[degree], S[degree], step / (degree + 1), V[degree + 1]);
            for (int s = 0; s <= K; s++) {
                double c = S[degree][s];
                if (degree == 0) size[s] = fmax(size[s], fabs(c)), negligible[s] = NEGLIGIBLE * size[s];
                P[s][degree] = fabs(c) > NOTHING * size[s] ? c : 0.0;
                small = small && fabs(c) * power <= negligible[s];
            }
            quiet = small ? quiet + 1 : 0;
            if (quiet > 1 && degree >= usual - 1) {
                for (int s = 0; s <= K; s++) {
                    double bound = 0.0;
                    const double *row = influence + ((mode ? 1 : 0) * (1 + K) + s) * N;
                    for (int r = 0; r < N; r++) bound += row[r] * fabs(V[degree][r]);
                    small = small && bound * power <= negligible[s] * (degree + 1);
                }
                if (small) break;
            }
            if (degree == MOST) break;
        }
        usual = degree;
        int whole = fabs(t_next - t - step) <= 1e-15 * (step + t), entered, crossed;
        double reach = whole ? 1.0 : fmax((t_next - t - late) / step, 0.0), late_next = 0.0;
        double exit_at = leave(P[0], degree, mode, on_limit, standing > 2, low, high, reach, &entered, &crossed);
        if (exit_at >= 0 || whole) {
            reach = exit_at >= 0 ? exit_at : 1.0;
            t_next = t + (late + reach * step);
            late_next = (late + reach * step) - (t_next - t);
        }

        if (reach > 0 && K > 0) {
            int piece = pieces & wrap, left = (pieces - 1) & wrap;
            for (int j = 0; j < K; j++)
                if (pieces - cursor[j] >= room || queued + K > room) result = -2;
            if (result) break;
            starts[piece] = t, lates[piece] = late, radii[piece] = radius, degrees[piece] = degree;
            for (int j = 0; j < K; j++) {
                memcpy(history[piece][j], P[1 + j], (degree + 1) * sizeof(double));
                if (!kink) continue;
                int before = pieces ? degrees[left] : 0;
                double moved = pieces ? (t - starts[left] + (late - lates[left])) / step : 0.0, L[ORDER + 1];
                memcpy(L, pieces ? history[left][j] : rest + j, (before + 1) * sizeof *L);
                if (gap(L, before, moved, P[1 + j], degree) > negligible[1 + j])
                    queued = insert(queue, queued, t + delays[j], 1e-13 * (step + t));
            }
            kink = 0;
            pieces++;
        }
        int made = 0;
        for (int g = 0; g < lags; g++) {
            const double *at = samples + g * count;
            int begin = sample[g], until = begin;
            while (until < count && (at[until] < t_next || t_next >= horizon)) until++;
            if (until == begin) continue;
            sample[g] = until;
            for (; made <= degree; made++) mode ? watched_1(V[made], O[made]) : watched_0(V[made], O[made]);
            for (int o = g == 0 ? -1 : groups[g]; o < groups[g + 1]; o++)
                for (int s = begin; s < until; s++) {
                    double tau = (at[s] - t - late) / step, value = 0.0;
                    for (int i = degree; i >= 0; i--) value = value * tau + (o < 0 ? P[0][i] : O[i][o]);
                    values[(1 + o) * count + s] = value;
                }
        }
        if (reach > 0) {
            double factor = 1.0;
            for (int i = 1; i <= degree; i++) {
                factor *= reach;
                for (int r = 0; r < N; r++) x[r] += factor * V[i][r];
            }
        }
        for (int r = 0; r < N; r++) {
            scale[r] = fmax(scale[r], fabs(x[r]));
            if (fabs(x[r]) < NOTHING * scale[r]) x[r] = 0.0;
            if (!(fabs(x[r]) < DIVERGENT)) result = -1;
        }
        standing = reach == 0 ? standing + 1 : 0;
        t = t_next, late = late_next;
        on_limit = crossed;
        if (exit_at >= 0) {
            if (event_count == most_events) result = -2;
            else mode = entered, kink = 1, events[event_count++] = t;
        }
        int passed = 0;
        for (; passed < queued && queue[passed] <= t + 1e-13 * (step + t); passed++) kink = 1;
        queued -= passed;
        if (passed) memmove(queue, queue + passed, queued * sizeof *queue);
    }
    free(starts), free(lates), free(radii), free(queue), free(degrees), free(history);
    return result ? result : event_count;
}
