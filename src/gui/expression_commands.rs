//! What a person tells the moving face: expressions, transport, files.

use std::path::{Path, PathBuf};

use super::action::Action;
use super::app::App;
use super::dialogs::Purpose;
use super::expression_work::Transport;
use super::view_state::{NoticeKind, Workspace};
use crate::expression::Expression;
use crate::expression::preset::EXTENSION;

impl App {
    /// Does what an action of the menu of the expression says.
    pub(super) fn act_on_expression(&mut self, action: Action, ctx: &egui::Context) {
        match action {
            Action::Preset(basic) => {
                self.view.workspace = Workspace::Expressions;
                let actuators = self.expression_work.ready().map(|r| std::sync::Arc::clone(&r.actuators));
                self.view.expressions.choose(basic, actuators.as_deref());
                self.expression_work.play();
            }
            Action::PlayPause => self.transport(Transport::PlayPause),
            Action::StepOnce => self.transport(Transport::Step),
            Action::ResetPlay => self.transport(Transport::Reset),
            Action::Settle => self.transport(Transport::Settle),
            Action::FromFit => {
                self.view.workspace = Workspace::Expressions;
                self.view.expressions.wants_fit = true;
            }
            Action::ClearExpression => self.view.expressions.clear(),
            Action::OpenExpression => self.dialogs.ask(ctx, Purpose::OpenExpression),
            Action::SaveExpression => {
                let name = self.view.expressions.expression.name.replace(['/', '\\', ':'], "-");
                let suggested = format!("{name}.{EXTENSION}");
                self.dialogs.ask(ctx, Purpose::SaveExpression { suggested });
            }
            Action::ExportExpression => self.dialogs.ask(ctx, Purpose::PlayFolder),
            _ => {}
        }
        ctx.request_repaint();
    }

    /// Takes an expression from a file and shows it.
    pub(super) fn open_expression(&mut self, path: &Path) {
        match Expression::load(path) {
            Ok(expression) => {
                self.view.workspace = Workspace::Expressions;
                self.view.expressions.open(expression);
                self.expression_work.play();
            }
            Err(e) => self.fail("The expression cannot be opened", e.to_string()),
        }
    }

    /// Writes the expression, with its intensity in it, under the name of its file.
    pub(super) fn save_expression(&mut self, mut path: PathBuf, ctx: &egui::Context) {
        if path.extension().is_none() {
            path.set_extension(EXTENSION);
        }
        let mut expression = self.view.expressions.wanted();
        let file = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let stem = file.strip_suffix(&format!(".{EXTENSION}")).or_else(|| file.split_once('.').map(|(s, _)| s));
        let name: String = stem.unwrap_or(&file).chars().filter(|c| !c.is_control()).take(80).collect();
        if !name.is_empty() {
            expression.name = name;
        }
        match expression.save(&path) {
            Ok(()) => self.tell(NoticeKind::Done, format!("Saved to {}.", path.display()), ctx),
            Err(e) => self.fail("The expression was not saved", e.to_string()),
        }
    }
}
