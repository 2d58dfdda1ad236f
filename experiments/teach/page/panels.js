// What stands below the question. Words from the server are shown as text.
const TABS = [
  { key: "f", name: "Last answer" }, { key: "a", name: "Advice" },
  { key: "g", name: "Progress" }, { key: "h", name: "What you said" }, { key: "c", name: "Keys" },
];
const KEYS = [
  ["arrows", "choose an action"], ["1 2 3", "my favourites"], ["space", "preview it"],
  ["enter", "answer"],
  ["d", "choose: nothing to do here"], ["u", "take back the last thing said"], ["s", "skip this question for good"],
  ["n", "ask me something else"], ["t", "robot: go on by yourself to the goal"],
  ["o", "ask what tells me most for your time"],
  ["p", "play the policy in physics; pause; hand back"], ["esc", "stop; leave a panel"],
  ["f a g h c", "these panels"], ["tab", "within a panel"],
];
const STATES = ["", "prefer", "avoid"];

// Something that was said: an answer is changed in its place, advice where it was given, and what
// cannot be changed is taken back. `edited` has the options of the answer that is being changed.
const Said = {
  template: `
  <div class="line" :class="{odd: each.rather}">
    <span><b>{{ each.what }}</b> <span class="soft">{{ each.where }}</span> <em v-if="each.note">{{ each.note }}</em>
      <span v-if="each.rather" class="warn"> By the rest I would have said: {{ each.rather }}</span></span>
    <select v-if="edited" :value="each.action" :data-edit="each.number" aria-label="change this answer"
        @change="$emit('edit', Number($event.target.value))">
      <option v-for="one in edited.options" :value="one.a">{{ one.w }}</option></select>
    <button v-else-if="each.names" :data-advice="each.number" @click="$emit('advise')">change</button>
    <button v-else-if="'action' in each" :data-change="each.number" @click="$emit('change')">change</button>
    <button v-else-if="each.back" :data-back="each.number" @click="$emit('back')">take back</button>
  </div>`,
  props: { each: Object, edited: Object },
  emits: ["edit", "advise", "change", "back"],
};

export default {
  template: `
  <section class="panels own-keys" data-teach="panels">
    <nav role="tablist"><button v-for="each in tabs" role="tab" :aria-selected="tab === each.key" :data-tab="each.key"
        @click="open(each.key)"><kbd>{{ each.key }}</kbd> {{ each.name }}</button></nav>

    <div v-if="tab === 'f'" class="pane" data-teach="given">
      <div v-if="!panels.given.words" class="soft">
        <p>I know what comes of my actions, and nothing of what you want. Think of a goal of your own, such as
          {{ panels.example }}, and show me:</p>
        <p>1. Choose an action with the arrow keys or the mouse. <kbd>space</kbd> previews it.</p>
        <p>2. <kbd>enter</kbd> tells me. I do it, and ask about the state that it led to.</p>
        <p>3. Once things are as you want them: <kbd>d</kbd> <kbd>enter</kbd>, nothing to do here.</p>
        <p>After one such trajectory I begin to guess, and ask where your answer tells me most. {{ panels.ways }}</p>
      </div>
      <template v-else>
        <p><b>{{ panels.given.words }}</b></p>
        <p data-teach="settled">{{ settled }}</p>
        <template v-if="panels.given.follows?.length">
          <p>I take this to follow, in {{ panels.given.count }} states. Untick what does not:</p>
          <div class="pictures">
            <label v-for="(each, i) in panels.given.follows" class="follow" :class="{off: off[i]}">
              <input type="checkbox" :checked="!off[i]" @change="off[i] = !off[i]">
              <span v-html="each.picture"></span>{{ each.what }}</label>
          </div>
          <button data-do="exclude" @click="exclude" :disabled="!off.some((x) => x)">Those do not follow</button>
        </template>
        <p v-else-if="panels.given.rules && !panels.given.excluded" class="soft">No rule says that anything follows from it elsewhere.</p>
        <template v-else-if="!panels.given.rules && panels.given.changed?.length">
          <p>I use no rules: what follows elsewhere I work out from what my actions lead to. Some of what I
            would do otherwise now; click what is wrong, and tell me:</p>
          <div class="pictures">
            <button v-for="each in panels.given.changed" class="follow" :data-ask="each.pair[0]" :title="each.where"
              @click="say({kind: 'ask', state: each.pair[0]})"><span v-html="each.picture"></span>{{ each.what }}</button>
          </div>
        </template>
        <p v-if="panels.given.excluded">{{ panels.given.excluded }} labels were refused.</p>
      </template>
    </div>

    <div v-if="tab === 'a'" class="pane" data-teach="advice">
      <p v-if="wanted" data-teach="wanted">Advice here would tell me most now. The question above waits.</p>
      <p v-else class="soft">Advice holds in many states at once. Choose what they have in common:</p>
      <div class="chips clusters"><button v-for="each in panels.clusters" :aria-pressed="chosen.includes(each.name)"
          :data-cluster="each.name" @click="pick(each.name)">{{ each.words }} <small>{{ each.count.toLocaleString("en") }}</small></button></div>
      <template v-if="group">
        <p data-teach="group">In every state where <b>{{ group.words }}</b> (<span data-teach="count">{{ group.count.toLocaleString("en") }}</span>):</p>
        <div class="pictures small"><span v-for="each in group.pictures" v-html="each"></span></div>
        <p class="soft">Click once what to prefer there, twice what to avoid:</p>
        <div v-for="(some, kind) in kinds" class="chips actions"><span v-if="kind" class="kind">{{ kind }}</span>
          <button v-for="each in some" :class="STATES[advice[each.a] ?? 0]"
            :data-advise="each.a" :title="STATES[advice[each.a] ?? 0] || 'neither'" @click="turn(each.a)">
            {{ {prefer: "+ ", avoid: "− "}[STATES[advice[each.a] ?? 0]] ?? "" }}{{ each.w.slice(kind ? kind.length + 2 : 0) }}</button></div>
        <p v-if="against" class="warn" data-teach="against">{{ against }} of your answers there show{{ against === 1 ? "s" : "" }} what you now avoid. Change the answer, or the advice:</p>
        <said v-for="each in contradicting" :key="each.number" :each="each" :edited="editing(each, 'against')"
          @change="change(each, 'against')" @edit="(action) => edit(each.number, action)"/>
        <button data-do="advise" class="go" @click="advise" :disabled="!group.count">Give this advice</button>
      </template>
    </div>

    <div v-if="tab === 'g'" class="pane" data-teach="progress">
      <p :class="{enough: progress.enough}" data-teach="enough"><b v-if="progress.enough">I have learnt enough, because </b>{{ progress.reason }}<span v-if="progress.standsIn" class="soft"> (this only says that the policy stopped changing)</span></p>
      <p v-if="progress.error" class="warn">{{ progress.error }}</p>
      <div class="charts">
        <figure v-for="curve in progress.curves"><figcaption>{{ curve.name }}: {{ Math.round(100 * last(curve)) }} %</figcaption>
          <svg viewBox="0 0 160 60" preserveAspectRatio="none"><path class="axis" d="M0,59.5 H160 M0,0.5 H160"/>
            <polyline class="curve" :points="line(curve.points)" data-teach="curve"/></svg></figure>
        <figure v-if="progress.episodes.length"><figcaption>questions an episode</figcaption>
          <svg viewBox="0 0 160 60" preserveAspectRatio="none"><path class="axis" d="M0,59.5 H160"/>
            <g v-for="(each, i) in episodes"><rect class="all" :x="each.x" :y="60 - each.steps" :width="each.w" :height="each.steps"/>
            <rect class="asked" :x="each.x" :y="60 - each.asked" :width="each.w" :height="each.asked"/></g></svg></figure>
      </div>
      <p class="soft">{{ progress.answers }} answer{{ progress.answers === 1 ? "" : "s" }}, {{ progress.rounds }} round{{ progress.rounds === 1 ? "" : "s" }} of learning with {{ progress.learner }}<span v-if="progress.learns">, {{ progress.learns }}</span><span v-if="progress.learning"> · learning …</span></p>
      <label class="switch"><input type="checkbox" :checked="state.alone" data-do="alone" @change="say({kind: 'alone', on: $event.target.checked})">
        act on your own while you are sure</label>
      <label class="switch"><input type="checkbox" :checked="state.leads" data-do="lead" @change="say({kind: 'lead', on: $event.target.checked})">
        choose yourself between states, trajectories and advice</label>
      <label class="switch"><input type="checkbox" :checked="state.holdsOut" data-do="hold_out" @change="say({kind: 'hold_out', on: $event.target.checked})">
        do not learn from one answer in ten, but be judged by it</label>
      <button data-do="begin" @click="say({kind: 'begin'})">A new trajectory from the start</button>
      <ul v-if="panels.report.length" class="report soft" data-teach="report"><li v-for="line in panels.report">{{ line }}</li></ul>
    </div>

    <div v-if="tab === 'h'" class="pane" data-teach="said">
      <p v-if="!panels.said.length" class="soft">Nothing yet.</p>
      <p v-else class="soft" data-teach="odd">{{ disagreeing }}
        <button v-if="panels.odd.old && !panels.odd.looking" data-do="odd" @click="say({kind: 'odd'})">Look again</button></p>
      <template v-for="[list, part] in [['odd', panels.odd.rows], ['said', panels.said]]">
        <said v-for="each in part" :key="list + each.number + (each.names ?? '')" :each="each" :edited="editing(each, list)"
          @change="change(each, list)" @edit="(action) => edit(each.number, action)"
          @advise="adviseOn(each.names, true)" @back="say({kind: 'undo', number: each.number})"/>
      </template>
    </div>

    <div v-if="tab === 'c'" class="pane keys"><div v-for="[key, what] in KEYS"><kbd>{{ key }}</kbd> {{ what }}</div></div>
  </section>`,
  components: { Said },
  props: { panels: Object, progress: Object, state: Object },
  data() {
    return { tab: "f", tabs: TABS, KEYS, STATES, chosen: [], group: null, advice: {}, off: [], edited: null, since: 0 };
  },
  computed: {
    settled() {
      const g = this.panels.given;
      const sure = Math.round(100 * g.sure);
      const learning = g.waits ? "I learn once you have shown me all of it, to the end." : "I am learning from it …";
      if (!g.had) return "I had no idea yet. " + (g.learnt ?? learning);
      const before = g.agreed ? `I would have done the same, and was ${sure} % sure. `
        : `I would have done something else (${g.had}), and was ${sure} % sure. `;
      return before + (g.learnt ?? learning);
    },
    wanted() {
      return this.chosen.length === 1 && this.chosen[0] === this.state.next?.cluster;
    },
    disagreeing() {
      const odd = this.panels.odd;
      if (odd.looking) return "Comparing each of your answers with all others …";
      if (!odd.looked) return "";
      if (!odd.judged) return "Once something was shown to its end I say which answers disagree with the rest.";
      return ["Your answers agree with one another.", "One answer disagrees with the rest. Was it a slip?"][odd.count]
        ?? `${odd.count} answers disagree with the rest, the oddest first. Were they slips?`;
    },
    // Actions by what their words begin with, such as carry: that is said once.
    kinds() {
      const kinds = {};
      for (const each of this.group.actions)
        (kinds[each.w.includes(": ") ? each.w.split(": ")[0] : ""] ??= []).push(each);
      return kinds;
    },
    avoided() {
      return (this.group?.actions ?? []).filter((each) => STATES[this.advice[each.a] ?? 0] === "avoid");
    },
    against() {
      return this.avoided.reduce((sum, each) => sum + each.shown, 0);
    },
    contradicting() {
      return this.avoided.flatMap((each) => each.answers).slice(0, 6);
    },
    episodes() {
      const all = this.progress.episodes.slice(-40), top = Math.max(4, ...all.map((e) => e.steps));
      const w = 160 / Math.max(all.length, 8);
      return all.map((e, i) => ({ x: i * w + 1, w: w - 2, asked: (58 * e.asked) / top, steps: (58 * e.steps) / top }));
    },
  },
  watch: {
    "panels.given.number"() {
      this.off = [];
    },
    // Once for each group, and not away from what somebody works at.
    "state.next.cluster"(name) {
      const busy = this.$el.contains(document.activeElement) || this.chosen.length;
      if (this.state.next?.opens && !busy && !this.offered.has(name)) this.adviseOn([name]);
    },
  },
  mounted() {
    this.onTab = (event) => this.open(event.detail, true);
    this.onTold = (event) => this.told(event.detail);
    this.onAdvise = (event) => this.adviseOn([event.detail], true);
    this.offered = new Set();
    window.addEventListener("teach-tab", this.onTab);
    window.addEventListener("teach-told", this.onTold);
    window.addEventListener("teach-advise", this.onAdvise);
  },
  unmounted() {
    window.removeEventListener("teach-tab", this.onTab);
    window.removeEventListener("teach-told", this.onTold);
    window.removeEventListener("teach-advise", this.onAdvise);
  },
  methods: {
    say(message) {
      window.teach?.say(message);
    },
    open(key, focus) {
      this.tab = key;
      if (key === "h") this.say({ kind: "odd" });
      if (!focus) return;
      this.$nextTick(() => {
        this.$el.scrollIntoView({ block: "end" });
        (this.$el.querySelector(".pane :is(button, input, select)")
          ?? this.$el.querySelector("nav [aria-selected=true]")).focus({ preventScroll: true });
      });
    },
    adviseOn(names, focus) {
      for (const name of names) this.offered.add(name);
      this.group = null;
      this.since = performance.now();
      this.choose(names);
      this.open("a", focus);
    },
    pick(name) {
      if (!this.chosen.length) this.since = performance.now();
      this.choose(this.chosen.includes(name) ? this.chosen.filter((x) => x !== name) : [...this.chosen, name]);
    },
    choose(names) {
      this.chosen = names;
      if (names.length) this.say({ kind: "group", names });
      else this.group = null;
    },
    editing(each, list) {
      return this.edited?.number === each.number && this.edited.list === list ? this.edited : null;
    },
    change(each, list) {
      this.changing = list; // it may be in several
      this.say({ kind: "options", number: each.number });
    },
    edit(number, action) {
      this.say({ kind: "edit", number, action });
      this.edited = null;
      this.choose(this.chosen); // what is counted there may be less now
    },
    told(reply) {
      if (reply.edited) {
        this.edited = { ...reply.edited, list: this.changing };
        this.$nextTick(() => this.$el.querySelector("[data-edit]")?.focus());
      }
      if (!reply.group) return;
      const same = this.group?.expression === reply.group.expression;
      this.group = reply.group;
      if (same) return; // and what is being said of it stays
      this.advice = {};
      this.$nextTick(() => this.$el.querySelector("[data-teach=group]")?.scrollIntoView({ block: "start" }));
      for (const a of reply.group.preferred) this.advice[a] = 1;
      for (const a of reply.group.avoided) this.advice[a] = 2;
    },
    turn(action) {
      this.advice = { ...this.advice, [action]: ((this.advice[action] ?? 0) + 1) % 3 };
    },
    of(state) {
      return this.group.actions.map((each) => each.a).filter((a) => STATES[this.advice[a] ?? 0] === state);
    },
    advise() {
      const seconds = (performance.now() - this.since) / 1000;
      this.since = performance.now();
      this.say({ kind: "advise", cluster: this.group.expression, preferred: this.of("prefer"), avoided: this.of("avoid"), seconds });
    },
    exclude() {
      const pairs = this.panels.given.follows.filter((_, i) => this.off[i]).map((each) => each.pair);
      this.say({ kind: "exclude", number: this.panels.given.number, pairs });
    },
    last(curve) {
      return curve.points.at(-1)[1];
    },
    line(points) {
      const most = Math.max(1, ...points.map((p) => p[0]));
      if (points.length === 1) points = [[0, points[0][1]], points[0]];
      return points.map(([x, y]) => `${((160 * x) / most).toFixed(1)},${(59 - 58 * y).toFixed(1)}`).join(" ");
    },
  },
};
