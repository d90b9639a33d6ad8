/* What guards the keys: the arithmetic of the machine code, word for word. */
static struct {
    uint32_t gain, heat, ceiling, since;
    uint16_t word;
    int16_t drive;
} $name_guards[$NAME_KEYS];
static uint32_t $name_turn, $name_ramp;

struct $name_safety $name_safety = { 0, 0, 0, -1 };

static int32_t $name_within(int32_t value, int32_t low, int32_t high)
{
    return value < low ? low : value > high ? high : value;
}

/* Drive words and gains of all keys become zero, and force comes up. */
static void $name_let_go(void)
{
    for (uint32_t key = 0; key < $NAME_KEYS; key++) {
        $name_state.outputs[key][0] = 0;
        $name_guards[key].gain = 0;
    }
    $name_ramp = $RAMPu;
}

/* Heat and gain of every sixteenth key. */
static void $name_service(uint32_t number)
{
    for (uint32_t key = number & 15u; key < $NAME_KEYS; key += 16u) {
        const int32_t drive = $name_state.outputs[key][0];
        const int32_t heat = (int32_t)$name_guards[key].heat + ((drive * drive - $RATED2) >> $HEAT_SHIFT);
        const uint32_t gain = $name_guards[key].gain + $STEPu, most = $name_guards[key].ceiling;
        $name_guards[key].heat = (uint32_t)$name_within(heat, 0, 0x3fffffff);
        $name_guards[key].gain = gain > most ? most : gain;
    }
}
@PAST
/* What each key's motor gave and got: stored energy, the last word, and the drive words of the past. */
static struct {
    int32_t stored;
    uint16_t word;
    int16_t past[$PAST];
} $name_ledger[$NAME_KEYS];
static uint32_t $name_oldest;

static void $name_passivity(void)
{
    $name_oldest = $name_oldest + 1u < $PASTu ? $name_oldest + 1u : 0;
    for (uint32_t key = 0; key < $NAME_KEYS; key++) {
        const int32_t way = (int32_t)$name_state.inputs[key][0] - (int32_t)$name_ledger[key].word;
        const int32_t drive = $name_within($name_ledger[key].past[$name_oldest] + ((way * $DAMPING) >> 8), -32768, 32767);
        const int32_t energy = drive * $name_within(way, -32768, 32767);
        const int64_t sum = (int64_t)$name_ledger[key].stored + energy;
        const int32_t stored = sum > 0 ? 0 : sum < INT32_MIN ? INT32_MIN : (int32_t)sum;
        const uint32_t most = (uint32_t)$name_within((stored + $CREDIT) >> $CREDIT_SHIFT, 0, 0x1ffff);
        $name_ledger[key].word = $name_state.inputs[key][0];
        $name_ledger[key].past[$name_oldest] = $name_state.outputs[key][0];
        $name_ledger[key].stored = stored;
        if (energy < 0 && most < $name_guards[key].gain) $name_guards[key].gain = most;
    }
}
@END
/* A motor at its limit gets less until half of its heat is gone. */
static void $name_judge_heat(uint32_t key)
{
    const uint32_t heat = $name_guards[key].heat, ceiling = $name_guards[key].ceiling;
    if (heat >= $HEAT_MAXu) {
        if (ceiling <= $CEILING_HOTu) return;
        $name_guards[key].ceiling = $CEILING_HOTu;
        $name_safety.faults = $name_safety.faults | $NAME_FAULT_HOT;
    } else {
        if (ceiling != $CEILING_HOTu || heat >= $HEAT_MAXu / 2u) return;
        $name_guards[key].ceiling = 65536u;
    }
    $name_ramp = $RAMPu;
}

/* A sensor that stays where it is frees its key. */
static void $name_judge_sensor(uint32_t key, uint32_t number)
{
    const uint16_t word = $name_state.inputs[key][0];
    const int16_t drive = $name_state.outputs[key][0];
    const uint32_t since = $name_guards[key].since, age = 2u * number - since;
    const int32_t moved = drive - $name_guards[key].drive, place = word;
    if ($name_ramp != 0 || word != $name_guards[key].word) {
        if ($name_ramp != 0) $name_ramp--;
        $name_guards[key].word = word;
        $name_guards[key].drive = drive;
        $name_guards[key].since = 2u * number;
        return;
    }
    if (moved > $MOVED || moved < -$MOVED) $name_guards[key].since = since | 1u;
    if (age < 2u * $AGE_RAILu - 1u) return;
    if (word == 0 || word == 65535u) {
        $name_safety.faults = $name_safety.faults | $NAME_FAULT_RAIL;
    } else {
        if (age < 2u * $AGE_FROZENu - 1u || ($name_guards[key].since & 1u) == 0) return;
        if (place < $MID_LOW || place > $MID_HIGH) return;
        $name_safety.faults = $name_safety.faults | $NAME_FAULT_FROZEN;
    }
    $name_guards[key].ceiling = 0;
    $name_safety.faulty_key = (int32_t)key;
}

void $name_safe_init(void)
{
    $name_init(&$name_state);
    $name_safety.tick = 0;
    $name_safety.missed = 0;
    $name_safety.faults = 0;
    $name_safety.faulty_key = -1;
    $name_turn = 0;
    memset($name_guards, 0, sizeof $name_guards);
    for (uint32_t key = 0; key < $NAME_KEYS; key++) $name_guards[key].ceiling = 65536u;
@PAST
    memset($name_ledger, 0, sizeof $name_ledger);
    $name_oldest = 0;
@END
    $name_let_go();
}

void $name_safe_tick(uint32_t number)
{
    const uint32_t next = $name_safety.tick + 1u;
    $name_safety.tick = number;
    if (number != next) {
        /* The first tick may have any number. */
        if (next != 1u) {
            $name_safety.missed = $name_safety.missed + (number - next);
            $name_safety.faults = $name_safety.faults | $NAME_FAULT_MISSED;
        }
        $name_let_go();
        return;
    }
    $name_tick(&$name_state);
    for (uint32_t key = 0; key < $NAME_KEYS; key++) {
        const int64_t drive = $name_state.outputs[key][0];
        $name_state.outputs[key][0] = (int16_t)((drive * (int64_t)$name_guards[key].gain) >> 16);
    }
    $name_service(number);
@PAST
    $name_passivity();
@END
    $name_turn = $name_turn + 1u < $NAME_KEYS ? $name_turn + 1u : 0;
    $name_judge_heat($name_turn);
    $name_judge_sensor($name_turn, number);
}
