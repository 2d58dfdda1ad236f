// The question, what can be done, and every key. Words from the server are shown as text.
const TYPING = ["INPUT", "TEXTAREA", "SELECT"];
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
const DONE = -1;
const RESEND = 1500; // milliseconds after which a message that was not heard is said again
const HURRY = 300; // milliseconds for which the view stands still, at most, until there is another question
const BOX = "teach-outbox";

export default {
  template: `
  <section class="question" :class="state.phase" data-teach="question" :data-token="question?.token"
      :data-state="question?.state" :data-favourite="question?.favourite" :data-chosen="selected">
    <div v-if="!question" class="waiting">There is nothing left to ask.</div>
    <template v-else>
      <header>
        <span class="pic" v-html="question.picture"></span>
        <div>
          <div class="ask">{{ state.correcting ? "You took over. What should the robot do?"
              : "What should the robot do here?" }}
            <span v-if="question.purpose" class="tag">{{ question.purpose }}</span>
            <span v-else-if="question.step" class="tag soft">step {{ question.step + 1 }}</span>
          </div>
          <div class="words" data-teach="words"><span v-for="part in question.words">{{ part }}</span></div>
        </div>
      </header>
      <div class="tops" v-if="question.top.length">
        <button v-for="(each, i) in question.top" class="top" tabindex="-1"
            :class="{chosen: each.a === selected}" :data-top="i + 1" @click="choose(each.a)">
          <kbd>{{ i + 1 }}</kbd> {{ each.w }}</button>
      </div>
      <div class="board">
        <div v-for="group in question.groups" class="group" :class="{map: group.map, folded: group.folded, last: !group.name}">
          <div class="name" v-if="group.name">{{ group.name }}
            <span v-if="group.folded" class="no">{{ group.rows[0][0].no }}</span></div>
          <div v-if="group.edges" class="edge"><span v-for="each in group.edges[0]">{{ each }}</span></div>
          <div v-for="(row, r) in group.rows" class="row">
            <span v-if="group.labels && !group.folded" class="label">{{ group.labels[r] }}</span>
            <template v-for="each in row">
              <span v-if="!each" class="gap"></span>
              <button v-else tabindex="-1" class="option" :class="{chosen: each.a === selected,
                  no: each.no, here: each.here}" :data-a="each.a" :aria-disabled="!!each.no"
                  :aria-label="each.w + (each.no ? ': ' + each.no : '')"
                  :title="each.w + (each.no ? ' — ' + each.no : '')"
                  @click="each.no ? tell(each) : click(each.a)">
                <kbd v-if="each.a === -1">d</kbd> {{ each.here ? "●" : each.t }}<sup v-if="rank(each.a)">{{ rank(each.a) }}</sup></button>
            </template>
          </div>
          <div v-if="group.edges" class="edge"><span v-for="each in group.edges[1]">{{ each }}</span></div>
        </div>
      </div>
      <div class="choice" data-teach="choice" aria-live="polite">
        <span v-if="reason" class="no">{{ reason }}</span>
        <span v-else-if="selected === null">Choose with the arrows or the mouse.</span>
        <span v-else>{{ selectedWords }}<em v-if="selected === question.favourite"> · what I would do</em></span>
      </div>
      <div class="bar">
        <button class="go" data-do="answer" @click="answer" :disabled="selected === null"><kbd>⏎</kbd> Answer</button>
        <button data-do="preview" @click="preview" :disabled="selected === null"><kbd>␣</kbd> Preview</button>
        <button v-for="each in actions" :data-do="each.kind" @click="act(each.kind)"><kbd>{{ each.key }}</kbd>
          {{ each.words }}</button>
      </div>
      <div class="why">
        <div class="name">Why this question?</div>
        <div class="because">{{ question.why.words }}</div>
        <div v-for="bar in question.why.bars" class="meter"><span>{{ bar.name }}</span>
          <i><b :style="{width: Math.round(100 * bar.share) + '%'}"></b></i>
          <span class="share">{{ Math.round(100 * bar.share) }} %</span></div>
        <div v-if="state.next" class="next" data-teach="next">{{ state.next.words }}
          <button v-if="!state.next.asked" data-do="suggested" tabindex="-1" @click="suggested"><kbd>o</kbd> Do that</button></div>
      </div>
    </template>
  </section>`,
  props: { question: Object, state: Object },
  data() {
    return { selected: null, reason: "", since: 0, box: {} };
  },
  computed: {
    options() {
      return this.question ? this.question.groups.flatMap((g) => g.rows.flat()).filter((o) => o) : [];
    },
    selectedWords() {
      return this.options.find((o) => o.a === this.selected)?.w ?? "";
    },
    actions() {
      if (this.state.correcting)
        return [{ kind: "play", key: "p", words: "Hand back" }, { kind: "stop", key: "esc", words: "Stop" }];
      const all = [
        { kind: "undo", key: "u", words: "Undo" },
        { kind: "skip", key: "s", words: "Skip" },
        { kind: "another", key: "n", words: "Another" },
        { kind: "on", key: "t", words: "Go on by yourself" },
      ];
      const play = { playing: "Pause", pausing: "Play on" }[this.state.phase] ?? "Play";
      if (this.state.canPlay) all.push({ kind: "play", key: "p", words: play });
      return all;
    },
  },
  watch: {
    "question.token"() {
      window.teach.hurry = 0;
      this.fresh();
    },
    "question.favourite"() {
      if (this.selected === null) this.preselect(); // it was learnt while the question stood there
    },
    "state.acks": {
      deep: true,
      handler(acks) {
        for (const id of acks) delete this.box[id];
        this.keep();
      },
    },
  },
  mounted() {
    try {
      this.box = JSON.parse(sessionStorage.getItem(BOX) ?? "{}");
    } catch {
      this.box = {};
    }
    window.teach = { say: this.say, hurry: 0 };
    this.onKey = (event) => this.key(event);
    window.addEventListener("keydown", this.onKey);
    this.timer = setInterval(this.resend, 500);
    this.fresh();
  },
  unmounted() {
    window.removeEventListener("keydown", this.onKey);
    clearInterval(this.timer);
  },
  methods: {
    fresh() {
      this.preselect();
      if (!document.activeElement?.closest(".own-keys")) this.$el.scrollIntoView({ block: "start" });
      this.reason = "";
      this.since = performance.now();
    },
    preselect() {
      const favourite = this.question?.favourite;
      const ok = this.options.some((o) => o.a === favourite && !o.no);
      this.selected = ok ? favourite : null;
    },
    rank(action) {
      const place = this.question.top.findIndex((each) => each.a === action);
      return place < 0 ? "" : place + 1;
    },
    tell(option) {
      this.reason = option.w + ": " + option.no;
    },
    choose(action) {
      const option = this.options.find((o) => o.a === action);
      if (!option) return;
      if (option.no) return this.tell(option);
      this.selected = action;
      this.reason = "";
    },
    click(action) {
      this.choose(action);
      if (this.question.groups[0].name === "move") this.answer();
      else this.preview();
    },
    step(key) {
      const [dx, dy] = ARROWS[key];
      if (this.question.groups[0].name === "move") {
        const arrow = { ArrowLeft: "←", ArrowRight: "→", ArrowUp: "↑", ArrowDown: "↓" }[key];
        return this.choose(this.options.find((o) => o.t === arrow).a);
      }
      const buttons = [...this.$el.querySelectorAll(".option:not(.no)")];
      const centre = (b) => {
        const r = b.getBoundingClientRect();
        return [r.x + r.width / 2, r.y + r.height / 2];
      };
      const from = buttons.find((b) => b.classList.contains("chosen"));
      let best = null, least = Infinity;
      const [x0, y0] = centre(from ?? buttons[0]);
      for (const b of buttons) {
        if (b === from) continue;
        const [x, y] = centre(b);
        const along = (x - x0) * dx + (y - y0) * dy;
        const across = Math.abs((x - x0) * dy) + Math.abs((y - y0) * dx);
        const cost = along + 2.5 * across;
        if (from && along > 4 && cost < least) [best, least] = [b, cost];
      }
      if (!from) best = buttons[0];
      if (best) this.choose(Number(best.dataset.a));
    },
    key(event) {
      const at = event.target;
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      if (at instanceof Element && TYPING.includes(at.tagName) && at.type !== "checkbox") return;
      const own = at instanceof Element && at.closest(".own-keys");
      const { key } = event;
      if (own && (key in ARROWS || key === " " || key === "Enter" || key === "Tab")) return;
      const letter = key.length === 1 ? key.toLowerCase() : key;
      const kind = this.actions.find((each) => each.key === letter)?.kind;
      if (key in ARROWS) this.question && this.step(key);
      else if (key === "Enter") event.repeat || this.answer();
      else if (key === " ") event.repeat || this.preview();
      else if ("123".includes(key) && this.question?.top[key - 1]) this.choose(this.question.top[key - 1].a);
      else if (letter === "d") this.choose(DONE);
      else if (kind) event.repeat || this.act(kind);
      else if (letter === "p" && this.state.canPlay) this.act("play");
      else if (letter === "o") event.repeat || this.suggested();
      else if (key === "Escape") {
        document.activeElement?.blur?.();
        this.$el.scrollIntoView({ block: "start" });
        if (this.state.phase !== "asking") this.act("stop");
      } else if ("faghc".includes(letter) && letter.length === 1)
        window.dispatchEvent(new CustomEvent("teach-tab", { detail: letter }));
      else return;
      event.preventDefault();
    },
    answer() {
      if (this.selected === null || !this.question) return;
      const seconds = (performance.now() - this.since) / 1000;
      window.teach.hurry = performance.now() + HURRY;
      this.say({ kind: "answer", question: this.question.token, action: this.selected, seconds },
               "answer-" + this.question.token);
    },
    preview() {
      if (this.selected === null || !this.question) return;
      this.say({ kind: "preview", action: this.selected });
    },
    suggested() {
      const next = this.state.next;
      if (next?.cluster) window.dispatchEvent(new CustomEvent("teach-advise", { detail: next.cluster }));
      else if (next && !next.asked) this.act("suggested");
    },
    act(kind) {
      this.say({ kind, question: this.question?.token ?? "" });
    },
    // What was said is kept until it was heard: through a lost socket, a reload, a new server.
    say(message, id) {
      id = id ?? crypto.randomUUID?.() ?? String(Math.random()).slice(2);
      if (id in this.box) return;
      this.box[id] = { ...message, id };
      this.keep();
      this.emit(id);
    },
    emit(id) {
      this.box[id].at = Date.now();
      const { at, ...message } = this.box[id];
      if (window.did_handshake !== false) this.$emit("say", message);
    },
    keep() {
      sessionStorage.setItem(BOX, JSON.stringify(this.box));
    },
    resend() {
      for (const id of Object.keys(this.box)) {
        // Motions are looked at when they are asked for, or not at all.
        const stale = Date.now() - (this.box[id].at ?? 0) > RESEND;
        if (stale && ["preview", "group", "play", "on"].includes(this.box[id].kind)) delete this.box[id];
        else if (stale) this.emit(id);
      }
    },
    told(reply) {
      window.dispatchEvent(new CustomEvent("teach-told", { detail: reply }));
    },
  },
};
